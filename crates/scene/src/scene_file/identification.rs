//! Parameters and outputs of sensitivities and fits.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A scene value to differentiate with respect to (`myovib sensitivity`) or to fit (`myovib fit`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// Key of the value, for example `material[0].c10`. The parameter of `solid.bulk_modulus` is 1/κ in
    /// 1/Pa, so that `inf` is 0.
    #[schemars(length(min = 1))]
    pub key: String,
    /// Starting value of a fit [default: the value in the scene].
    pub start: Option<f64>,
    /// Typical size [default: the size of the value]; required if the value is 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Lower bound of a fit.
    pub low: Option<f64>,
    /// Upper bound of a fit.
    pub high: Option<f64>,
}

/// A measured column of a probe. Without outputs, all columns are used as `PROBE.COLUMN`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Output {
    /// Column name in the data, or `observableId`.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Name of the probe.
    pub probe: String,
    /// Column of the probe's CSV file, for example `u_y`.
    pub column: String,
    /// Standard deviation of a measurement, in the unit of the column; the data may override it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub noise: Option<f64>,
}

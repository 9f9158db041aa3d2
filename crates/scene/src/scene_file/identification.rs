//! Which numbers of a scene are asked about, and what is compared with measurements.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A number of the scene whose influence is asked for (`myovib sensitivity`), or that is to be found
/// from measurements (`myovib fit`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// The number, as `--set` names it: `material[0].c10`, `solid.alpha`,
    /// `traction[0].y.amplitude`. `solid.kappa` stands for 1/κ in 1/Pa, so that `inf` is 0.
    #[schemars(length(min = 1))]
    pub key: String,
    /// Where a fit starts [default: the value in the scene].
    pub start: Option<f64>,
    /// Its typical size [default: that of its value]; needed where the value is 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// The least value a fit may take.
    pub low: Option<f64>,
    /// The largest value a fit may take.
    pub high: Option<f64>,
}

/// A column of a probe under the name that measurements have [default: all columns of all probes,
/// named `PROBE.COLUMN`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Output {
    /// The name of the column, or the `observableId`, in the data.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Name of the probe.
    pub probe: String,
    /// Name of the probe's column, as in its CSV file: `u_y`.
    pub column: String,
    /// Standard deviation of a measurement, in the unit of the column; data may give their own.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub noise: Option<f64>,
}

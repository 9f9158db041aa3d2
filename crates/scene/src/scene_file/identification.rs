//! Which numbers of a scene are asked about, and what is compared with measurements.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A number of the scene that sensitivities (`myovib sensitivity`) or fits (`myovib fit`) are of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// The number, as `--set` names it: `material[0].c10`. `solid.kappa` stands for 1/κ in 1/Pa, so
    /// that `inf` is 0.
    #[schemars(length(min = 1))]
    pub key: String,
    /// Where a fit starts [default: the value in the scene].
    pub start: Option<f64>,
    /// Its typical size [default: that of its value]; needed where the value is 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Lower bound of a fit.
    pub low: Option<f64>,
    /// Upper bound of a fit.
    pub high: Option<f64>,
}

/// A column of a probe under the name it has in the data [default: all columns, as `PROBE.COLUMN`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Output {
    /// Its name in the data, or its `observableId`.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Name of the probe.
    pub probe: String,
    /// Its column, as in its CSV file: `u_y`.
    pub column: String,
    /// Standard deviation of a measurement, in the column's unit; data may give their own.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub noise: Option<f64>,
}

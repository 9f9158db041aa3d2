//! Loading path of a static analysis.

use myovib_model::statics::Control;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Default number of load increments.
const INCREMENTS: usize = 10;
/// Default maximum number of arc-length steps.
const MAX_STEPS: usize = 100;
/// Default load factor of the first arc-length step.
const FIRST_LOAD: f64 = 0.1;

/// Loading path of a static analysis. A load factor multiplies the loads at `time.end`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoadingPath {
    /// Method by which the path is followed.
    #[serde(default)]
    pub method: PathMethod,
    /// Number of equal load increments [default: 10], or maximum number of arc-length steps [default: 100].
    #[schemars(range(min = 1, max = 100_000))]
    pub steps: Option<usize>,
    /// Load factors of the equilibria, in the order in which they are computed; instead of `steps`.
    #[schemars(length(min = 1))]
    pub loads: Option<Vec<f64>>,
    /// Load factor of the first arc-length step [default: 0.1].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub first_load: Option<f64>,
}

/// Method by which a loading path is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PathMethod {
    /// Given load factors. A failed step is halved. The path ends if a failed step is below 1/512 of the load and changes
    /// the displacement gradients by less than 4e-4, or if it is below 2e-9 of the load.
    #[default]
    Load,
    /// Steps along the path, past limit points, until the load factor is 1 or -1. The path also ends at a failed step below
    /// 1/512 of the first step.
    ArcLength,
}

impl LoadingPath {
    /// Returns the control of the path, or a key without effect and the reason.
    pub(crate) fn control(&self) -> Result<Control, (&'static str, &'static str)> {
        match self.method {
            PathMethod::Load if self.first_load.is_some() => {
                Err(("first_load", "only method = \"arc-length\" has a first load"))
            }
            PathMethod::ArcLength if self.loads.is_some() => {
                Err(("loads", "with method = \"arc-length\" the loads are unknown"))
            }
            _ if self.loads.is_some() && self.steps.is_some() => {
                Err(("loads", "either `steps` or `loads` determines the path"))
            }
            PathMethod::Load => Ok(Control::Load(self.loads.clone().unwrap_or_else(|| {
                let n = self.steps.unwrap_or(INCREMENTS);
                (1..=n).map(|i| i as f64 / n as f64).collect()
            }))),
            PathMethod::ArcLength => Ok(Control::ArcLength {
                first_load: self.first_load.unwrap_or(FIRST_LOAD),
                max_steps: self.steps.unwrap_or(MAX_STEPS),
            }),
        }
    }
}

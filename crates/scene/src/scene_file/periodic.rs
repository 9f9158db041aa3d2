//! Periodic state of a scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Periodic state under loads that repeat.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Periodic {
    /// Frequency of the motion, Hz [default: the only frequency of the loads].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub frequency: Option<f64>,
    /// Time, s, from which the loads repeat [default: determined from the loads].
    #[schemars(range(min = 0))]
    pub start_time: Option<f64>,
    /// Number of periods integrated before the search [default: none if harmonic balance finds a start, else 3, then 12 and 48
    /// if the search fails].
    #[schemars(range(max = 100_000))]
    pub settling_periods: Option<usize>,
    /// Maximum difference of the states at the ends of the period, relative to the size of the motion.
    // Integrator tolerances are 0.01 of it, and at least 1e-14.
    #[schemars(range(min = 1e-11, max = 1e-2))]
    pub tolerance: f64,
    /// Number of Floquet multipliers; 0 omits the stability, which takes most of the time of large bodies.
    #[schemars(range(max = 1000))]
    pub multipliers: usize,
    /// Number of values of each probe.
    #[schemars(range(min = 8, max = 100_000))]
    pub samples: usize,
    /// Curve of periodic states as a scene value varies, through folds.
    pub continuation: Option<Continuation>,
}

/// Curve of periodic states from the value of a number in the scene to another value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Continuation {
    /// Key of the number, such as `"traction[0].y.frequency"`.
    pub parameter: String,
    /// Value at which the curve ends.
    pub to: f64,
    /// Largest step of the curve: change of the parameter relative to its range, or of the motion relative to its size
    /// at the start.
    #[serde(default = "Continuation::max_step")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_step: f64,
    /// Largest number of points.
    #[serde(default = "Continuation::max_points")]
    #[schemars(range(min = 2, max = 100_000))]
    pub max_points: usize,
}

impl Continuation {
    const fn max_step() -> f64 {
        0.1
    }

    const fn max_points() -> usize {
        200
    }
}

impl Default for Periodic {
    fn default() -> Self {
        Self {
            frequency: None,
            start_time: None,
            settling_periods: None,
            tolerance: 1e-6,
            multipliers: 4,
            samples: 128,
            continuation: None,
        }
    }
}

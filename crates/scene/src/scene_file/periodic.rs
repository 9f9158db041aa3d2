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
    /// Time from which the loads repeat, s [default: determined from the loads].
    #[schemars(range(min = 0))]
    pub start_time: Option<f64>,
    /// Number of periods integrated before the search [default: none if harmonic balance finds a starting state, otherwise 3,
    /// followed by 12 and 48 if the search fails].
    #[schemars(range(max = 100_000))]
    pub settling_periods: Option<usize>,
    /// Maximum difference between the states at the ends of the period, relative to the size of the motion.
    // The integrator tolerances are 0.01 times this tolerance, but at least 1e-14.
    #[schemars(range(min = 1e-11, max = 1e-2))]
    pub tolerance: f64,
    /// Number of Floquet multipliers. A value of 0 omits the stability analysis, which takes most of the time for large
    /// bodies.
    #[schemars(range(max = 1000))]
    pub multipliers: usize,
    /// Number of values of each probe.
    #[schemars(range(min = 8, max = 100_000))]
    pub samples: usize,
    /// Curve of periodic states along which a scene value varies; it may pass through folds.
    pub continuation: Option<Continuation>,
}

/// Curve of periodic states along which a number varies from its value in the scene to another value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Continuation {
    /// Key of the number, such as `"traction[0].y.frequency"`.
    pub parameter: String,
    /// Value at which the curve ends.
    pub to: f64,
    /// Largest step along the curve: the change of the parameter relative to its range, or the change of the motion
    /// relative to its initial size.
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

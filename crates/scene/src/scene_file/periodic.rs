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
    /// Time, s, from which the loads repeat.
    #[schemars(range(min = 0))]
    pub start_time: f64,
    /// Number of periods integrated before the search.
    pub settling_periods: usize,
    /// Maximum difference of the states at the ends of the period, relative to the size of the motion.
    // Integrator tolerances are 0.01 of it, and at least 1e-14.
    #[schemars(range(min = 1e-11, max = 1e-2))]
    pub tolerance: f64,
    /// Number of Floquet multipliers.
    #[schemars(range(min = 1))]
    pub multipliers: usize,
    /// Number of values of each probe.
    #[schemars(range(min = 8, max = 100_000))]
    pub samples: usize,
}

impl Default for Periodic {
    fn default() -> Self {
        Self {
            frequency: None,
            start_time: 0.0,
            settling_periods: 3,
            tolerance: 1e-6,
            multipliers: 4,
            samples: 128,
        }
    }
}

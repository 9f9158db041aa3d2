//! Two-way coupling in a scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The effect of a chain on the stiffness: all constants of the materials but κ are multiplied by
/// `coherent + (unsynchronised - coherent) (1 - S)`, with S = |χ|², made smooth at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Feedback {
    /// Name of the chain; chains in elements act on their elements.
    pub chain: String,
    /// Group of elements where it acts [default: all; feedbacks without a group share each point by
    /// the inverse squares of its distances from their chains].
    pub group: Option<String>,
    /// Factor without coherence, or at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unsynchronised: f64,
    /// Factor at full coherence.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub coherent: f64,
    /// Amplitude of an oscillator below which it counts as at rest.
    #[serde(default = "radius")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
}

fn one() -> f64 {
    1.0
}

/// A tenth of the limit cycle of a van der Pol oscillator, whose radius is 2.
pub(super) fn radius() -> f64 {
    0.2
}

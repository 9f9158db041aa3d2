//! Two-way coupling in a scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A chain whose coherence sets the stiffness around it: two-way coupling.
///
/// All constants of the materials but κ are multiplied by `coherent + (unsynchronised - coherent) (1 - S)`,
/// with S the square of the phase coherence |χ|, made smooth at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Feedback {
    /// Name of the chain; chains in elements act on their own elements.
    pub chain: String,
    /// Group of elements where it acts [default: everywhere; feedbacks without a group share
    /// each point by the inverse squares of its distances from their chains].
    pub group: Option<String>,
    /// Factor of the stiffness while the oscillators are out of step, or at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unsynchronised: f64,
    /// Factor of the stiffness once they agree.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub coherent: f64,
    /// Radius, in the unit of the oscillators' positions, below which an oscillator counts as
    /// being at rest.
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

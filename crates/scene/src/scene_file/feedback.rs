//! Two-way coupling of chains and body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::one;

/// Multiplies all moduli except κ by a factor that changes linearly with S = |χ|² of a chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Feedback {
    /// Name of the chain. Chains with `elements` act on the elements in which they are located.
    pub chain: String,
    /// Group of elements [default: all; several feedbacks are averaged with inverse squared distances as weights].
    pub group: Option<String>,
    /// Factor without coherence or at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub at_zero_coherence: f64,
    /// Factor at full coherence.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub at_full_coherence: f64,
    /// Amplitude below which an oscillator counts as being at rest; the transition is smooth.
    #[serde(default = "rest_amplitude")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub rest_amplitude: f64,
}

/// Returns a tenth of the radius 2 of the limit cycle of a van der Pol oscillator.
pub(super) fn rest_amplitude() -> f64 {
    0.2
}

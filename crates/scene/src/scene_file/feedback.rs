//! Two-way coupling of chains and body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Effect of a chain on the stiffness. The factor
/// `at_full_coherence + (at_zero_coherence - at_full_coherence) (1 - S)` multiplies all moduli except κ. S is |χ|²,
/// smoothed near rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Feedback {
    /// Name of the chain. Chains in elements act on their elements.
    pub chain: String,
    /// Group of elements where it acts [default: all]. Without groups, each point blends all feedbacks,
    /// weighted by the inverse squared distance to their chains.
    pub group: Option<String>,
    /// Factor without coherence or at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub at_zero_coherence: f64,
    /// Factor at full coherence.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub at_full_coherence: f64,
    /// Amplitude below which an oscillator counts as at rest.
    #[serde(default = "rest_amplitude")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub rest_amplitude: f64,
}

fn one() -> f64 {
    1.0
}

/// A tenth of the limit cycle of a van der Pol oscillator, whose radius is 2.
pub(super) fn rest_amplitude() -> f64 {
    0.2
}

//! Two-way coupling of chains and body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::one;

/// Multiplies all moduli except κ by a factor that changes linearly with S = |χ|² of a chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Feedback {
    /// Name of the chain; chains in elements act on their elements.
    pub chain: String,
    /// Group of elements [default: all; several feedbacks are blended by inverse squared distance].
    pub group: Option<String>,
    /// Factor without coherence or at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub at_zero_coherence: f64,
    /// Factor at full coherence.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub at_full_coherence: f64,
    /// Amplitude of an oscillator at rest.
    #[serde(default = "rest_amplitude")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub rest_amplitude: f64,
}

/// A tenth of the limit cycle of a van der Pol oscillator, whose radius is 2.
pub(super) fn rest_amplitude() -> f64 {
    0.2
}

//! Coupling of the oscillators to the displacement of the tissue.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Oscillators that the forcing acts on: usually all, because cells are tiny and a cluster of them moves with a single
/// point of the tissue. The boundary of an array is its rim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Reach {
    /// All oscillators.
    #[default]
    All,
    /// First and last oscillator.
    Boundary,
}

/// The one-way coupling from the tissue to the oscillators.
///
/// `c(u) = γ u(ξ, t)`. Paper: eq. (24) and the formula after it.
///
/// # Units
/// The `gain` is in 1/s² per unit of displacement (the position of an oscillator is dimensionless).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Gain γ.
    pub gain: f64,
    /// Oscillators on which c(u) acts.
    pub reach: Reach,
}

impl Default for Drive {
    /// Returns γ = 1 for all oscillators (the paper does not state a value).
    fn default() -> Self {
        Self { gain: 1.0, reach: Reach::All }
    }
}

impl Drive {
    /// Returns the forcing c(u) = γ u for the displacement u of the tissue. Its derivative is `gain`.
    ///
    /// # Examples
    /// ```
    /// use myovib_oscillators::Drive;
    /// let drive = Drive { gain: 4000.0, ..Drive::default() };
    /// assert_eq!(drive.forcing(0.05), 200.0);
    /// ```
    pub fn forcing(&self, displacement: f64) -> f64 {
        self.gain * displacement
    }
}

//! Material of elements. Elements of the same material are computed together.

use crate::error::FemError;
use crate::material::{Law, Range, VolumeFunction};

/// Bulk modulus and damping of an element, relative to the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementScale {
    /// Ratio of κ, which must be positive.
    pub kappa: f64,
    /// Ratio of α, which must not be negative.
    pub alpha: f64,
    /// Ratio of β, which must not be negative.
    pub beta: f64,
}

impl ElementScale {
    /// Scales of an element that has the values of the body.
    pub const ONE: Self = Self { kappa: 1.0, alpha: 1.0, beta: 1.0 };

    /// Checks the ranges of the ratios.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if a ratio is out of range.
    pub(crate) fn check(&self) -> Result<(), FemError> {
        Range::Positive.check("ratio of kappa", self.kappa)?;
        Range::NotNegative.check("ratio of alpha", self.alpha)?;
        Range::NotNegative.check("ratio of beta", self.beta)
    }
}

/// Law, added stress, Prony series and scales of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ElementMaterial {
    pub(crate) law: Law,
    /// Index of the added stress, if any.
    pub(crate) added: Option<usize>,
    /// Index of the Prony series, if any.
    pub(crate) prony: Option<usize>,
    pub(crate) scale: ElementScale,
    pub(crate) volume_function: VolumeFunction,
}

impl ElementMaterial {
    /// Returns whether the same code can compute elements of both materials.
    pub(crate) fn is_computed_like(&self, other: &Self) -> bool {
        self.law == other.law && self.volume_function == other.volume_function
    }
}

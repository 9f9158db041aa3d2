//! What elements are made of: those of one kind are computed together.

use crate::error::FemError;
use crate::material::{Law, Range};

/// Bulk modulus and damping of an element by those of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratios {
    /// κ of the element by κ of the body; positive.
    pub kappa: f64,
    /// The same for α; zero or positive.
    pub alpha: f64,
    /// The same for β; zero or positive.
    pub beta: f64,
}

impl Ratios {
    /// Those of the body.
    pub const ONE: Self = Self {
        kappa: 1.0,
        alpha: 1.0,
        beta: 1.0,
    };

    /// Checks the ranges.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
    pub(crate) fn check(&self) -> Result<(), FemError> {
        Range::Positive.check("ratio of kappa", self.kappa)?;
        Range::NotNegative.check("ratio of alpha", self.alpha)?;
        Range::NotNegative.check("ratio of beta", self.beta)
    }
}

/// Law, added stress, Prony terms and constants of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Kind {
    pub(crate) law: Law,
    /// The number of the stress that is added to the law's, if one is.
    pub(crate) added: Option<usize>,
    /// The number of its Prony terms, if it has some.
    pub(crate) relaxing: Option<usize>,
    pub(crate) ratios: Ratios,
}

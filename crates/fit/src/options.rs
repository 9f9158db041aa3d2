//! What a fit is asked for.

use crate::error::FitError;
use crate::loss::Loss;

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The fit is converged when a step changes no parameter by more than this fraction of its
    /// size, or when the residuals are orthogonal to all derivatives to this cosine; 1e-8 by
    /// default.
    pub tolerance: f64,
    /// And when the step to the least of the linearised problem is shorter than this fraction of the
    /// uncertainty of the parameters: the relative offset of Bates and Watts (1981). What further steps
    /// would find is within the noise. 0 by default: the tolerance alone counts.
    pub offset: f64,
    /// Most iterations, each with one Jacobian; 100 by default.
    pub max_iterations: usize,
    /// How much a residual counts; least squares by default.
    pub loss: Loss,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            offset: 0.0,
            max_iterations: 100,
            loss: Loss::Squares,
        }
    }
}

impl Options {
    pub(crate) fn check(&self) -> Result<(), FitError> {
        let refuse = |option, value, expected| {
            Err(FitError::Option {
                option,
                value,
                expected,
            })
        };
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return refuse("tolerance", self.tolerance, "in (0, 1)");
        }
        if !(self.offset >= 0.0 && self.offset.is_finite()) {
            return refuse("offset", self.offset, "nonnegative and finite");
        }
        match self.loss.delta() {
            Some(delta) if !(delta > 0.0 && delta.is_finite()) => {
                refuse("delta of the loss", delta, "positive and finite")
            }
            _ => Ok(()),
        }
    }
}

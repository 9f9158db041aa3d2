//! Settings of fits.

use crate::error::FitError;
use crate::loss::Loss;

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The fit has converged when a step changes every parameter by less than this fraction of its value, or when the
    /// cosine of the angle between the residuals and each derivative is below a thousandth of this value. Default:
    /// 1e-8.
    pub tolerance: f64,
    /// The fit has also converged when the length of the Gauss–Newton step is below this fraction of the parameters'
    /// uncertainty (the relative offset of Bates and Watts, 1981). Further steps would stay within the noise. Default:
    /// 0 (not used).
    pub offset: f64,
    /// Maximum number of iterations. Each iteration computes one Jacobian. Default: 100.
    pub max_iterations: usize,
    /// Loss function. Default: least squares.
    pub loss: Loss,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: 1e-8, offset: 0.0, max_iterations: 100, loss: Loss::Squares }
    }
}

impl Options {
    pub(crate) fn check(&self) -> Result<(), FitError> {
        let refuse = |option, value, expected| Err(FitError::Option { option, value, expected });
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

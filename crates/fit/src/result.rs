//! Results of fits.

use nalgebra::DMatrix;

use crate::loss::Loss;

/// Reason why a fit ended.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ended {
    /// The tolerance was reached, or any further reduction of the cost would be below rounding errors.
    Converged,
    /// The maximum number of iterations was reached.
    MaxIterations,
    /// The observer ended the fit.
    Interrupted,
    /// The model cannot be evaluated in the direction of smaller costs, the derivatives cannot be computed, or all
    /// derivatives are zero.
    Failed(String),
}

/// State of the fit at the beginning of an iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct Iteration {
    /// Half the sum of the losses.
    pub cost: f64,
    /// Values of the parameters.
    pub values: Vec<f64>,
    /// Number of evaluations of the residuals so far, excluding those for difference quotients.
    pub evaluations: usize,
}

/// Result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Names of the parameters.
    pub names: Vec<String>,
    /// Values of the parameters.
    pub values: Vec<f64>,
    /// Whether each value is at a bound.
    pub at_bound: Vec<bool>,
    /// Half the sum of the losses.
    pub cost: f64,
    /// Residuals at the fitted values.
    pub residuals: Vec<f64>,
    /// Jacobian of the residuals, n_residuals × n_parameters.
    pub jacobian: DMatrix<f64>,
    /// Reason why the fit ended.
    pub ended: Ended,
    /// Iterations of the fit, in order.
    pub history: Vec<Iteration>,
    /// Number of evaluations of the residuals, excluding those for difference quotients.
    pub evaluations: usize,
    pub(crate) loss: Loss,
}

impl Fit {
    /// Returns whether the fit converged.
    pub fn is_converged(&self) -> bool {
        self.ended == Ended::Converged
    }

    /// Returns whether any measurement depends on parameter `j`, that is, whether a derivative with respect to it is
    /// nonzero.
    pub fn acts(&self, j: usize) -> bool {
        self.jacobian.column(j).norm() > 0.0
    }

    /// Returns the indices of the parameters that have a nonzero derivative.
    pub(crate) fn acting(&self) -> Vec<usize> {
        (0..self.values.len()).filter(|&j| self.acts(j)).collect()
    }

    /// Returns the number of measurements minus the number of parameters that have an effect on them.
    pub fn degrees_of_freedom(&self) -> usize {
        self.residuals.len() - self.acting().len()
    }

    /// Returns the Jacobian, in which each row is multiplied by the weight of the loss.
    pub(crate) fn weighted_jacobian(&self) -> DMatrix<f64> {
        let mut jacobian = self.jacobian.clone();
        for (mut row, &r) in jacobian.row_iter_mut().zip(&self.residuals) {
            row *= self.loss.weight(r);
        }
        jacobian
    }
}

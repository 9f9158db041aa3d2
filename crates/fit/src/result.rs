//! What a fit came to.

use nalgebra::DMatrix;

use crate::loss::Loss;

/// How a fit ended.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ended {
    /// To the tolerance, or as far as rounding lets the cost be told.
    Converged,
    /// The limit on iterations.
    MaxIterations,
    /// The observer ended it.
    Interrupted,
    /// Residuals could not be computed in the direction of smaller costs, or derivatives could not be computed, or all
    /// of them are zero.
    Failed(String),
}

/// One iteration, at its beginning.
#[derive(Debug, Clone, PartialEq)]
pub struct Iteration {
    /// Half the sum of the losses.
    pub cost: f64,
    /// The parameters.
    pub values: Vec<f64>,
    /// Evaluations of the residuals so far, those of difference quotients apart.
    pub evaluations: usize,
}

/// The result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The parameters' names.
    pub names: Vec<String>,
    /// The parameters' values.
    pub values: Vec<f64>,
    /// Whether each lies on a bound.
    pub at_bound: Vec<bool>,
    /// Half the sum of the losses.
    pub cost: f64,
    /// The residuals.
    pub residuals: Vec<f64>,
    /// Their derivatives, n_residuals × n_parameters.
    pub jacobian: DMatrix<f64>,
    /// How it ended.
    pub ended: Ended,
    /// All iterations.
    pub history: Vec<Iteration>,
    /// Evaluations of the residuals, those of difference quotients apart.
    pub evaluations: usize,
    pub(crate) loss: Loss,
}

impl Fit {
    /// Whether it converged.
    pub fn is_converged(&self) -> bool {
        self.ended == Ended::Converged
    }

    /// Whether a measurement depends on parameter `j`: whether a derivative by it is not zero.
    pub fn acts(&self, j: usize) -> bool {
        self.jacobian.column(j).norm() > 0.0
    }

    /// The parameters that measurements depend on.
    pub(crate) fn acting(&self) -> Vec<usize> {
        (0..self.values.len()).filter(|&j| self.acts(j)).collect()
    }

    /// Measurements less the parameters that they depend on.
    pub fn degrees_of_freedom(&self) -> usize {
        self.residuals.len() - self.acting().len()
    }

    /// The derivatives and residuals as they count under the loss.
    pub(crate) fn weighted_jacobian(&self) -> DMatrix<f64> {
        let mut jacobian = self.jacobian.clone();
        for (mut row, &r) in jacobian.row_iter_mut().zip(&self.residuals) {
            row *= self.loss.weight(r);
        }
        jacobian
    }
}

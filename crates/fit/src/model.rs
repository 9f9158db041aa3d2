//! The interface of models.

use nalgebra::DMatrix;

use crate::differences;

/// Reason why the model cannot be evaluated at a point; the fit then tries a shorter step.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Failed(pub String);

/// Residuals as a function of parameters: (model − measurement)/σ for each measurement.
pub trait Model {
    /// Number of residuals.
    fn n_residuals(&self) -> usize;

    /// Writes the residuals at the parameters `p`.
    ///
    /// # Errors
    /// [`Failed`] if the model cannot be evaluated; non-finite residuals have the same effect.
    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed>;

    /// Writes ∂r_i/∂p_j (n_residuals × n_parameters). By default, central difference quotients are used, with steps
    /// proportional to `scale`.
    ///
    /// # Errors
    /// Errors of [`residuals`](Model::residuals).
    fn jacobian(&mut self, p: &[f64], scale: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        differences::central(|p, out| self.residuals(p, out), p, scale, out)
    }

    /// Writes the residuals and, if one evaluation can return both, the derivatives; returns whether it wrote both.
    /// Implement this method if derivatives cost little more than residuals: most trial steps are accepted, so their
    /// derivatives are needed next.
    ///
    /// # Errors
    /// Errors of [`residuals`](Model::residuals).
    fn residuals_with_jacobian(
        &mut self,
        p: &[f64],
        _scale: &[f64],
        out: &mut [f64],
        _jacobian: &mut DMatrix<f64>,
    ) -> Result<bool, Failed> {
        self.residuals(p, out)?;
        Ok(false)
    }
}

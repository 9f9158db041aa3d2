//! Interface of models.

use nalgebra::DMatrix;

use crate::differences;

/// Reason why the model cannot be evaluated at a point. The fit then tries a shorter step.
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
    /// Returns [`Failed`] if the model cannot be evaluated. Non-finite residuals have the same effect.
    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed>;

    /// Writes the Jacobian ∂r_i/∂p_j (n_residuals × n_parameters). By default, it is computed by central difference
    /// quotients with steps proportional to `scale`.
    ///
    /// # Errors
    /// Returns the same errors as [`residuals`](Model::residuals).
    fn jacobian(&mut self, p: &[f64], scale: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        differences::central(|p, out| self.residuals(p, out), p, scale, out)
    }

    /// Writes the residuals and, if one evaluation can provide both, the derivatives. Returns whether the derivatives
    /// were written. Implement this method if derivatives cost little more than residuals: most trial steps are
    /// accepted, and the next step then needs the derivatives.
    ///
    /// # Errors
    /// Returns the same errors as [`residuals`](Model::residuals).
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

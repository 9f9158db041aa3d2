//! What a fit asks of the model.

use nalgebra::DMatrix;

use crate::differences;

/// Why residuals could not be computed at some parameters; the fit takes a shorter step.
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
    /// [`Failed`] where the model cannot be evaluated; a value that is not finite counts the same.
    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed>;

    /// Writes ∂r_i/∂p_j, n_residuals × n_parameters; by central differences with steps in
    /// proportion to `scale` unless the model knows better.
    ///
    /// # Errors
    /// As for [`residuals`](Model::residuals).
    fn jacobian(&mut self, p: &[f64], scale: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        differences::central(|p, out| self.residuals(p, out), p, scale, out)
    }

    /// Writes the residuals and, where the same evaluation gives them at little more, the derivatives
    /// too; whether it did. To be replaced where a run with sensitivities is not much longer than one
    /// without: most trial steps are taken, and need them next.
    ///
    /// # Errors
    /// As for [`residuals`](Model::residuals).
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

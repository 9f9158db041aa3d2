//! Perturbed systems for explicit derivatives of readings.

use myovib_dae::Parameters;

use super::dependence::Dependences;
use crate::error::ModelError;
use crate::muscle_dae::MuscleDae;

/// Parameters with perturbed systems. Quantities of perturbed systems are evaluated in the same way as for the original
/// system.
pub trait PerturbedSystems<P>: Parameters<P> {
    /// Returns the derivatives of quantities with respect to parameter j at a fixed state. `read` computes the
    /// quantities for a system, and `own` contains their values for the unperturbed system.
    ///
    /// # Errors
    /// Errors of `read`.
    fn reading_derivative(
        &mut self,
        problem: &P,
        j: usize,
        own: &[f64],
        read: &mut dyn FnMut(&mut P) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError>;
}

impl PerturbedSystems<MuscleDae> for Dependences {
    fn reading_derivative(
        &mut self,
        _: &MuscleDae,
        j: usize,
        own: &[f64],
        read: &mut dyn FnMut(&mut MuscleDae) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError> {
        self.get_mut(j).reading_derivative(own, read)
    }
}

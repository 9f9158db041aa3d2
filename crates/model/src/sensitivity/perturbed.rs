//! Perturbed systems for explicit derivatives of readings.

use myovib_dae::Parameters;

use super::dependence::Dependences;
use crate::error::ModelError;
use crate::muscle_dae::MuscleDae;

/// Parameters with perturbed systems of which the same quantities can be read.
pub trait PerturbedSystems<P>: Parameters<P> {
    /// Returns the derivative with respect to parameter j, in a given state, of the quantities that
    /// `read` computes; `own` are their values for the problem itself.
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

//! What can be read off systems that differ in a parameter.

use myovib_dae::Parameters;

use super::dependence::Dependences;
use crate::error::ModelError;
use crate::muscle_dae::MuscleDae;

/// Parameters with systems that differ in them, off which the same can be read.
pub trait Twins<P>: Parameters<P> {
    /// The derivative by parameter j, in a given state, of what `read` gives, of which `own` is the problem's.
    ///
    /// # Errors
    /// Those of `read`.
    fn of_reading(
        &mut self,
        problem: &P,
        j: usize,
        own: &[f64],
        read: &mut dyn FnMut(&mut P) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError>;
}

impl Twins<MuscleDae> for Dependences {
    fn of_reading(
        &mut self,
        _: &MuscleDae,
        j: usize,
        own: &[f64],
        read: &mut dyn FnMut(&mut MuscleDae) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError> {
        self.get_mut(j).of_reading(own, read)
    }
}

//! What oscillators can be coupled to.

use myovib_dae::{LinearSolver, Problem};
use myovib_sparse::klu::{KluError, KluOptions};

use super::no_body::NoBody;
use crate::linear::CondensedSolver;
use crate::muscle_dae::MuscleDae;
use crate::rod_dae::RodDae;

/// A body's own linear solver.
pub type BodySolver<B> = Box<dyn LinearSolver<B> + Send>;

/// A body that oscillators can be coupled to.
pub trait Body: Problem + Send + Sized + 'static {
    /// The shortest time in which what drives the body changes, s, if something does.
    fn time_scale(&self) -> Option<f64> {
        None
    }

    /// A shorter way to solve the body's Newton systems than KLU on the whole matrix, if there is
    /// one.
    ///
    /// # Errors
    /// Those of the analysis.
    fn condensed_solver(&self, _options: KluOptions) -> Result<Option<BodySolver<Self>>, KluError> {
        Ok(None)
    }
}

impl Body for MuscleDae {
    fn time_scale(&self) -> Option<f64> {
        self.muscle().time_scale()
    }

    fn condensed_solver(&self, options: KluOptions) -> Result<Option<BodySolver<Self>>, KluError> {
        Ok(Some(Box::new(CondensedSolver::new(self, options)?)))
    }
}

impl Body for RodDae {
    fn time_scale(&self) -> Option<f64> {
        self.signal().time_scale()
    }
}

impl Body for NoBody {}

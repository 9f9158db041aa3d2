//! What oscillators can be coupled to.

use myovib_dae::LinearSolver;
use myovib_sparse::SparseError;
use myovib_sparse::klu::KluOptions;

use super::no_body::NoBody;
use crate::error::ModelError;
use crate::linear::CondensedSolver;
use crate::muscle_dae::MuscleDae;
use crate::rod_dae::RodDae;
use crate::signal::schedule::Schedule;
use crate::start::Consistent;

/// A body's own linear solver.
pub type BodySolver<B> = Box<dyn LinearSolver<B> + Send>;

/// A body that oscillators can be coupled to.
pub trait Body: Consistent + Send + Sized + 'static {
    /// What drives the body.
    fn schedule(&self) -> Schedule {
        Schedule::default()
    }

    /// A shorter way to solve the body's Newton systems than KLU on the whole matrix, if there is
    /// one.
    ///
    /// # Errors
    /// Those of the analysis.
    fn condensed_solver(
        &self,
        _options: KluOptions,
    ) -> Result<Option<BodySolver<Self>>, SparseError> {
        Ok(None)
    }
}

impl Body for MuscleDae {
    fn schedule(&self) -> Schedule {
        self.muscle().schedule()
    }

    fn condensed_solver(
        &self,
        options: KluOptions,
    ) -> Result<Option<BodySolver<Self>>, SparseError> {
        Ok(Some(Box::new(CondensedSolver::new(self, options)?)))
    }
}

impl Body for RodDae {
    fn schedule(&self) -> Schedule {
        RodDae::schedule(self)
    }
}

impl Consistent for RodDae {
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        Ok([y.to_vec(), self.rates(t, y)?])
    }
}

impl Body for NoBody {}

impl Consistent for NoBody {
    fn consistent(&mut self, _: f64, _: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        Ok([Vec::new(), Vec::new()])
    }
}

//! Systems that can drive oscillators.

use myovib_dae::LinearSolver;
use myovib_sparse::SparseError;
use myovib_sparse::SparseOptions;

use super::dae::CoupledDae;
use super::feedback::FeedbackDae;
use super::feedback_solver::FeedbackSolver;
use super::no_body::NoBody;
use super::solver::CoupledSolver;
use crate::error::ModelError;
use crate::linear::CondensedSolver;
use crate::muscle_dae::MuscleDae;
use crate::rod_dae::RodDae;
use crate::signal::schedule::Schedule;
use crate::start::Consistent;

/// Linear solver for the Newton systems of `B`.
pub type SystemMatrices<B> = Box<dyn LinearSolver<B> + Send>;

/// A condensed solver of a system, if one is available.
pub(super) type SolverIfCondensed<B> = Result<Option<SystemMatrices<B>>, SparseError>;

/// A body that can drive oscillators, or a coupled system of such a body and its oscillators.
pub trait Body: Consistent + Send + Sized + 'static {
    /// Returns the excitation of the body.
    fn schedule(&self) -> Schedule {
        Schedule::default()
    }

    /// Returns a condensed solver for the body's Newton systems, if it is available and cheaper than factorizing
    /// the full matrix.
    fn condensed_solver(&mut self, _options: SparseOptions) -> SolverIfCondensed<Self> {
        Ok(None)
    }
}

impl Body for MuscleDae {
    fn schedule(&self) -> Schedule {
        self.muscle().schedule()
    }

    fn condensed_solver(&mut self, options: SparseOptions) -> SolverIfCondensed<Self> {
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

impl<B: Body> Body for CoupledDae<B> {
    /// Returns the excitation of the body and the oscillators, together with the oscillators' periods.
    fn schedule(&self) -> Schedule {
        let mut schedule = self.body().schedule();
        for k in 0..self.n_networks() {
            self.oscillators(k).add_to(&mut schedule);
        }
        schedule
    }

    fn condensed_solver(&mut self, options: SparseOptions) -> SolverIfCondensed<Self> {
        let Some(body) = self.body_mut().condensed_solver(options)? else {
            return Ok(None);
        };
        Ok(Some(Box::new(CoupledSolver::new(body, self, options)?)))
    }
}

/// The oscillators are eliminated from the Newton systems.
impl Body for FeedbackDae {
    fn schedule(&self) -> Schedule {
        self.one_way().schedule()
    }

    fn condensed_solver(&mut self, options: SparseOptions) -> SolverIfCondensed<Self> {
        Ok(Some(Box::new(FeedbackSolver::new(self, options)?)))
    }
}

impl Body for NoBody {
    fn condensed_solver(&mut self, _: SparseOptions) -> SolverIfCondensed<Self> {
        Ok(Some(Box::new(Self)))
    }
}

impl Consistent for NoBody {
    fn consistent(&mut self, _: f64, _: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        Ok([Vec::new(), Vec::new()])
    }
}

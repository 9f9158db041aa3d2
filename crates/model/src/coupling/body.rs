//! What oscillators can be coupled to.

use sundials_wrap::klu::{KluError, KluOptions};
use sundials_wrap::{DaeProblem, StructuredSolver};

use super::no_body::NoBody;
use crate::linear::CondensedSolver;
use crate::muscle_dae::MuscleDae;
use crate::rod_dae::RodDae;

/// A body's own linear solver.
pub type BodySolver<B> = Box<dyn StructuredSolver<B> + Send>;

/// A body that oscillators can be coupled to.
pub trait Body: DaeProblem + Send + Sized + 'static {
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
    fn condensed_solver(&self, options: KluOptions) -> Result<Option<BodySolver<Self>>, KluError> {
        let solver = CondensedSolver::new(self, options)?;
        Ok(solver.map(|solver| Box::new(solver) as BodySolver<Self>))
    }
}

impl Body for RodDae {}

impl Body for NoBody {}

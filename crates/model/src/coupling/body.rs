//! What oscillators can be coupled to.

use myovib_dae::{Problem, StructuredSolver};
use myovib_radau::{Method, NewtonMatrices};
use myovib_sparse::klu::{KluError, KluOptions};

use super::no_body::NoBody;
use crate::linear::{CondensedMatrices, CondensedSolver};
use crate::muscle_dae::MuscleDae;
use crate::rod_dae::RodDae;

/// A body's own linear solver.
pub type BodySolver<B> = Box<dyn StructuredSolver<B> + Send>;

/// A body's own Newton matrices for Radau IIA.
pub type BodyMatrices<B> = Box<dyn NewtonMatrices<B>>;

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

    /// The same for Radau IIA.
    ///
    /// # Errors
    /// Those of the analysis.
    fn condensed_matrices(
        &self,
        _options: KluOptions,
        _method: &Method,
    ) -> Result<Option<BodyMatrices<Self>>, KluError> {
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

    fn condensed_matrices(
        &self,
        options: KluOptions,
        method: &Method,
    ) -> Result<Option<BodyMatrices<Self>>, KluError> {
        let matrices = CondensedMatrices::new(self, options, method)?;
        Ok(Some(Box::new(matrices)))
    }
}

impl Body for RodDae {
    fn time_scale(&self) -> Option<f64> {
        self.signal().time_scale()
    }
}

impl Body for NoBody {}

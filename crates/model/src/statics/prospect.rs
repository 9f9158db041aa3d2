//! Predictions made before a search for an equilibrium begins.

use myovib_sparse::Prediction;

use super::newton::Newton;
use crate::cpu::CpuClock;
use crate::error::ModelError;
use crate::field::Layout;
use crate::formulation::Formulation;
use crate::muscle::Muscle;

/// A prepared search for an equilibrium that has not begun.
pub(crate) struct Prospect<'a> {
    newton: Newton<'a>,
}

/// Response of the body to the full load according to linear elasticity, and the cost of computing it by one iteration
/// of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinearResponse {
    /// The largest nodal |u|, m.
    pub(crate) displacement: f64,
    /// CPU time of the computation, s.
    pub(crate) seconds: f64,
}

impl<'a> Prospect<'a> {
    /// Prepares the search for the equilibrium of `muscle` under its loads at time `t`.
    ///
    /// # Errors
    /// Errors of [`equilibrium`](super::equilibrium) that do not depend on the loads.
    pub(crate) fn new(
        muscle: &'a Muscle,
        formulation: Formulation,
        t: f64,
    ) -> Result<Self, ModelError> {
        muscle.check_at_rest()?;
        Ok(Self { newton: Newton::new(muscle, formulation, t)? })
    }

    /// Returns the blocks of unknowns.
    pub(crate) fn layout(&self) -> &Layout {
        &self.newton.layout
    }

    /// Returns the predicted memory and work for factorizing the iteration matrix, if known in advance.
    pub(crate) fn needs(&self) -> Option<Prediction> {
        self.newton.needs
    }

    /// Returns the memory in use before the factorization, B, if the operating system reports it.
    pub(crate) fn in_use(&self) -> Option<usize> {
        self.newton.in_use
    }

    /// Returns the CPU time (s) for evaluating the iteration matrix at rest.
    ///
    /// # Errors
    /// Returns no error for a body at rest.
    pub(crate) fn evaluation(&mut self) -> Result<f64, ModelError> {
        let clock = CpuClock::start();
        let rest = vec![0.0; self.newton.layout.n_unknowns()];
        self.newton.tangent(&rest, 0.0)?;
        Ok(clock.elapsed().as_secs_f64())
    }

    /// Computes the response of the body to its loads according to linear elasticity.
    ///
    /// # Errors
    /// [`ModelError::Factorization`] if the supports of the body are insufficient.
    pub(crate) fn linear_response(&mut self) -> Result<LinearResponse, ModelError> {
        let newton = &mut self.newton;
        let clock = CpuClock::start();
        let rest = vec![0.0; newton.layout.n_unknowns()];
        let answer = newton.direction(&rest, 0.0)?;
        let seconds = clock.elapsed().as_secs_f64();
        Ok(LinearResponse { displacement: newton.largest_displacement(&answer), seconds })
    }
}

//! Linear solvers that know more than a sparsity pattern.

use crate::problem::StepError;

/// A direct solver for (∂F/∂y + c_j ∂F/∂ẏ) x = b that knows the structure of its problem.
///
/// It takes the place of KLU: for a problem whose unknowns can be condensed, a Schur complement is
/// a shorter way. As with KLU, IDAS solves with an old matrix while c_j has changed little, and
/// then scales the solution by 2/(1 + c_j/c_j,old).
pub trait StructuredSolver<P> {
    /// Forms and factorises the matrix at (t, y, ẏ) and `c_j`.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] (a singular matrix, a state outside the domain): IDAS tries a
    /// smaller step; [`StepError::Fatal`]: the integration ends.
    fn setup(
        &mut self,
        problem: &mut P,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        c_j: f64,
    ) -> Result<(), StepError>;

    /// Solves with the matrix of the last [`setup`](StructuredSolver::setup), in place.
    ///
    /// # Errors
    /// As for [`setup`](StructuredSolver::setup).
    fn solve(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError>;
}

impl<P, S: StructuredSolver<P> + ?Sized> StructuredSolver<P> for Box<S> {
    fn setup(
        &mut self,
        problem: &mut P,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        c_j: f64,
    ) -> Result<(), StepError> {
        (**self).setup(problem, t, y, y_dot, c_j)
    }

    fn solve(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        (**self).solve(problem, rhs)
    }
}

//! Linear solvers for Newton's method, with real and complex shifts.

use num_complex::Complex64;

use crate::columns;
use crate::linearization::Linearization;
use crate::problem::StepError;

/// Solves with the Newton matrices ∂F/∂y + c ∂F/∂ẏ of a problem `P`: evaluated at a state, set up
/// for some c, solved with.
///
/// BDF asks for one real c at a time, a Radau IIA method of s stages for one real c and
/// (s − 1)/2 complex ones. An implementation may use structure that the sparse matrix of the whole
/// does not show (blocks that are diagonal, unknowns that can be eliminated).
///
/// All errors mean what they do for a residual: after a recoverable one (a singular matrix, a state
/// outside the domain) the step is tried with a smaller h; a fatal one ends the integration.
pub trait LinearSolver<P> {
    /// Evaluates ∂F/∂y and ∂F/∂ẏ at a state and keeps them.
    ///
    /// # Errors
    /// Those of the problem.
    fn evaluate(&mut self, problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError>;

    /// Prepares solves with ∂F/∂y + c ∂F/∂ẏ for the `real` c and for each of the `complex` ones.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] if a matrix is singular.
    fn set_up(
        &mut self,
        problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError>;

    /// Solves in place with the real matrix of the last [`set_up`](LinearSolver::set_up).
    ///
    /// # Errors
    /// Those of the solve.
    fn solve_real(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError>;

    /// Solves in place with complex matrix `k` of the last [`set_up`](LinearSolver::set_up),
    /// counted from 0.
    ///
    /// # Errors
    /// Those of the solve.
    fn solve_complex(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError>;

    /// Solves in place with the real matrix for several right-hand sides, the numbers of a row side by
    /// side. By default for one after the other: to be replaced where one pass over the factors serves
    /// them all.
    ///
    /// # Shapes
    /// `rhs`: the number of unknowns times `n_columns`.
    ///
    /// # Errors
    /// Those of the solve.
    fn solve_real_columns(
        &mut self,
        problem: &mut P,
        rhs: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        columns::one_by_one(rhs, n_columns, |column| self.solve_real(problem, column))
    }

    /// Solves in place with complex matrix `k`, likewise.
    ///
    /// # Errors
    /// Those of the solve.
    fn solve_complex_columns(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        columns::one_by_one(rhs, n_columns, |column| {
            self.solve_complex(problem, k, column)
        })
    }

    /// Solves in place with the transpose of the real matrix, as an adjoint asks for.
    ///
    /// # Errors
    /// Those of the solve; by default there is none, which is fatal.
    fn solve_real_transposed(
        &mut self,
        _problem: &mut P,
        _rhs: &mut [f64],
    ) -> Result<(), StepError> {
        Err(no_transposed_solves())
    }

    /// Solves in place with the transpose (not conjugated) of complex matrix `k`, likewise.
    ///
    /// # Errors
    /// Those of the solve; by default there is none, which is fatal.
    fn solve_complex_transposed(
        &mut self,
        _problem: &mut P,
        _k: usize,
        _rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        Err(no_transposed_solves())
    }

    /// Evaluations of the residual that the matrices took so far, for
    /// [`difference_evaluations`](crate::Statistics::difference_evaluations).
    fn difference_evaluations(&self) -> u64 {
        0
    }

    /// How often pivots have been chosen that later set-ups keep, of all matrices together; 0 where a
    /// set-up depends on nothing but the last evaluation and its shifts.
    fn pivot_choices(&self) -> u64 {
        0
    }

    /// Makes the next set-up choose all pivots anew.
    fn forget_pivots(&mut self) {}

    /// What else of the past decides how systems are solved; nothing by default.
    fn history(&self) -> Vec<bool> {
        Vec::new()
    }

    /// Goes on with a [`history`](LinearSolver::history), that of a solver of the same problem.
    ///
    /// # Errors
    /// Those of the analysis.
    fn set_history(&mut self, _history: &[bool]) -> Result<(), StepError> {
        Ok(())
    }
}

fn no_transposed_solves() -> StepError {
    let message = "this linear solver has no transposed solves, which the adjoint needs: \
                   give the integrator one that has";
    StepError::Fatal(message.into())
}

/// A choice made at run time.
impl<P, S: LinearSolver<P> + ?Sized> LinearSolver<P> for Box<S> {
    fn evaluate(&mut self, problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError> {
        (**self).evaluate(problem, at)
    }

    fn set_up(
        &mut self,
        problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        (**self).set_up(problem, real, complex)
    }

    fn solve_real(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        (**self).solve_real(problem, rhs)
    }

    fn solve_complex(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        (**self).solve_complex(problem, k, rhs)
    }

    fn solve_real_transposed(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        (**self).solve_real_transposed(problem, rhs)
    }

    fn solve_complex_transposed(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        (**self).solve_complex_transposed(problem, k, rhs)
    }

    fn solve_real_columns(
        &mut self,
        problem: &mut P,
        rhs: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        (**self).solve_real_columns(problem, rhs, n_columns)
    }

    fn solve_complex_columns(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        (**self).solve_complex_columns(problem, k, rhs, n_columns)
    }

    fn difference_evaluations(&self) -> u64 {
        (**self).difference_evaluations()
    }

    fn pivot_choices(&self) -> u64 {
        (**self).pivot_choices()
    }

    fn forget_pivots(&mut self) {
        (**self).forget_pivots();
    }

    fn history(&self) -> Vec<bool> {
        (**self).history()
    }

    fn set_history(&mut self, history: &[bool]) -> Result<(), StepError> {
        (**self).set_history(history)
    }
}

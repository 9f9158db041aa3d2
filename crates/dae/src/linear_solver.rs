//! Linear solvers for Newton's method with real and complex shifts.

use num_complex::Complex64;

use crate::columns;
use crate::linearization::Linearization;
use crate::problem::StepError;

/// Solver for linear systems with the Newton matrices ∂F/∂y + c ∂F/∂ẏ of a problem `P`. It evaluates the two matrices
/// at a state, factorizes their combination for given values of c, and solves.
///
/// BDF methods need one real c at a time. A Radau IIA method of s stages needs one real c and (s − 1)/2 complex values.
/// An implementation may use structure that the pattern of the sparse matrix does not show (diagonal blocks, unknowns
/// that can be eliminated).
///
/// Errors have the same meaning as for a residual. After a recoverable error (a singular matrix, a state outside the
/// domain), the step is repeated with a smaller h. A fatal error ends the integration.
pub trait LinearSolver<P> {
    /// Evaluates and stores ∂F/∂y and ∂F/∂ẏ at a state.
    ///
    /// # Errors
    /// Returns errors of the problem.
    fn evaluate(&mut self, problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError>;

    /// Factorizes ∂F/∂y + c ∂F/∂ẏ for the `real` c and for each of the `complex` values.
    ///
    /// # Errors
    /// Returns [`StepError::Recoverable`] if a matrix is singular.
    fn set_up(
        &mut self,
        problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError>;

    /// Solves in place with the real matrix of the last [`set_up`](LinearSolver::set_up).
    ///
    /// # Errors
    /// Fails if the system cannot be solved.
    fn solve_real(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError>;

    /// Solves in place with complex matrix `k`, counted from 0, of the last [`set_up`](LinearSolver::set_up).
    ///
    /// # Errors
    /// Fails if the system cannot be solved.
    fn solve_complex(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError>;

    /// Solves in place with the real matrix for several right-hand sides stored row by row. The default implementation
    /// solves column by column. Override it if one pass over the factors can handle all columns.
    ///
    /// # Shapes
    /// `rhs`: the number of unknowns times `n_columns`.
    ///
    /// # Errors
    /// Fails if the system cannot be solved.
    fn solve_real_columns(
        &mut self,
        problem: &mut P,
        rhs: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        columns::one_by_one(rhs, n_columns, |column| self.solve_real(problem, column))
    }

    /// Solves in place with complex matrix `k` for several right-hand sides stored row by row.
    ///
    /// # Errors
    /// Fails if the system cannot be solved.
    fn solve_complex_columns(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        columns::one_by_one(rhs, n_columns, |column| self.solve_complex(problem, k, column))
    }

    /// Solves in place with the transpose of the real matrix, as needed by an adjoint method.
    ///
    /// # Errors
    /// Fails if the system cannot be solved. The default does not support transposed solves and returns a fatal error.
    fn solve_real_transposed(
        &mut self,
        _problem: &mut P,
        _rhs: &mut [f64],
    ) -> Result<(), StepError> {
        Err(no_transposed_solves())
    }

    /// Solves in place with the transpose (not conjugated) of complex matrix `k`.
    ///
    /// # Errors
    /// Fails if the system cannot be solved. The default does not support transposed solves and returns a fatal error.
    fn solve_complex_transposed(
        &mut self,
        _problem: &mut P,
        _k: usize,
        _rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        Err(no_transposed_solves())
    }

    /// Returns the number of residual evaluations used for the matrices so far. It is included in
    /// [`difference_evaluations`](crate::Statistics::difference_evaluations).
    fn difference_evaluations(&self) -> u64 {
        0
    }

    /// Returns the number of pivot selections so far in all matrices if setups reuse earlier pivots. Returns 0 if a
    /// setup depends only on the last evaluation and on the shifts.
    fn pivot_choices(&self) -> u64 {
        0
    }

    /// Makes the next setup select new pivots for all matrices.
    fn forget_pivots(&mut self) {}

    /// Returns further information on past setups that affects later solves; empty by default.
    fn history(&self) -> Vec<bool> {
        Vec::new()
    }

    /// Restores the [`history`](LinearSolver::history) of another solver for the same problem.
    ///
    /// # Errors
    /// Returns errors of the symbolic analysis.
    fn set_history(&mut self, _history: &[bool]) -> Result<(), StepError> {
        Ok(())
    }
}

fn no_transposed_solves() -> StepError {
    let message = "the adjoint requires transposed solves, which this linear solver does not support: use \
                   another linear solver";
    StepError::Fatal(message.into())
}

/// A solver selected at run time.
impl<P, S: LinearSolver<P> + ?Sized> LinearSolver<P> for Box<S> {
    crate::forward! { S;
        mut evaluate(problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError>;
        mut set_up(problem: &mut P, real: f64, complex: &[Complex64]) -> Result<(), StepError>;
        mut solve_real(problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError>;
        mut solve_complex(
            problem: &mut P, k: usize, rhs: &mut [Complex64]
        ) -> Result<(), StepError>;
        mut solve_real_columns(
            problem: &mut P, rhs: &mut [f64], n_columns: usize
        ) -> Result<(), StepError>;
        mut solve_complex_columns(
            problem: &mut P, k: usize, rhs: &mut [Complex64], n_columns: usize
        ) -> Result<(), StepError>;
        mut solve_real_transposed(problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError>;
        mut solve_complex_transposed(
            problem: &mut P, k: usize, rhs: &mut [Complex64]
        ) -> Result<(), StepError>;
        mut forget_pivots();
        mut set_history(history: &[bool]) -> Result<(), StepError>;
        ref difference_evaluations() -> u64;
        ref pivot_choices() -> u64;
        ref history() -> Vec<bool>;
    }
}

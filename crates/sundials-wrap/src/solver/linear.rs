//! Linear solvers for Newton's method.

use myovib_dae::{Jacobian, LinearSolver, Linearization, Problem, StepError};
use myovib_sparse::pivoting::{Factors, Symbolic};
use myovib_sparse::{DenseLu, SparseError, SparseOptions};

/// Linear solver for a problem `P`.
pub(super) enum Linear<P> {
    /// LU factorization of the whole matrix.
    Whole(Box<WholeLu>),
    /// Linear solver provided by the user.
    Own(Box<dyn LinearSolver<P> + Send>),
}

impl<P: Problem> Linear<P> {
    /// Evaluates the two matrices at a state, or only ∂F/∂y + c_j ∂F/∂ẏ if this sum is sufficient. Returns the entries
    /// of the sum. Difference quotients are computed either for the sum or for each matrix separately.
    pub(super) fn evaluate(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        c_j: f64,
        in_parts: bool,
    ) -> (Result<(), StepError>, &[f64]) {
        match self {
            Self::Whole(lu) => match in_parts {
                true => lu.evaluate_parts(problem, at, c_j),
                false => lu.evaluate(problem, at, c_j),
            },
            Self::Own(solver) => (solver.evaluate(problem, at), &[]),
        }
    }

    /// Factorizes ∂F/∂y + c_j ∂F/∂ẏ at the state of the last evaluation.
    pub(super) fn set_up(&mut self, problem: &mut P, c_j: f64) -> Result<(), StepError> {
        match self {
            Self::Whole(lu) => lu.factorize(),
            Self::Own(solver) => solver.set_up(problem, c_j, &[]),
        }
    }

    /// Solves in place.
    pub(super) fn solve(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        match self {
            Self::Whole(lu) => lu.solve(rhs),
            Self::Own(solver) => solver.solve_real(problem, rhs),
        }
    }

    /// Returns the number of residual evaluations for difference quotients so far.
    pub(super) fn difference_evaluations(&self) -> u64 {
        match self {
            Self::Whole(lu) => lu.jacobian.residual_evaluations(),
            Self::Own(solver) => solver.difference_evaluations(),
        }
    }

    /// Returns the smallest estimate of the reciprocal condition number since the start.
    pub(super) fn smallest_rcond(&self) -> Option<f64> {
        match self {
            Self::Whole(lu) => lu.smallest_rcond,
            Self::Own(_) => None,
        }
    }

    /// Resets the smallest estimate of the reciprocal condition number.
    pub(super) fn forget_rcond(&mut self) {
        if let Self::Whole(lu) = self {
            lu.smallest_rcond = None;
        }
    }
}

/// Newton matrix and its factors. The matrix is computed from differences if the problem does not implement its
/// Jacobian.
pub(super) struct WholeLu {
    jacobian: Jacobian,
    values: Vec<f64>,
    factors: WholeFactors,
    smallest_rcond: Option<f64>,
}

/// Factors of a sparse or a full matrix.
enum WholeFactors {
    Sparse(Factors<f64>),
    Dense(DenseLu),
}

/// Minimum order at which full matrices are factorized in dense blocks. Sparse LU factorizes smaller ones in less than
/// a millisecond.
const DENSE_FROM: usize = 64;

impl WholeLu {
    /// Allocates a matrix with the pattern of the Jacobian.
    pub(super) fn new(jacobian: Jacobian, options: SparseOptions) -> Result<Self, SparseError> {
        let pattern = jacobian.pattern();
        let (n, nnz) = (pattern.major_dim(), pattern.nnz());
        let factors = match n >= DENSE_FROM && nnz == n * n {
            true => WholeFactors::Dense(DenseLu::new(n)),
            false => WholeFactors::Sparse(Factors::new(Symbolic::analyze(pattern, options)?)),
        };
        Ok(Self { values: vec![0.0; nnz], factors, smallest_rcond: None, jacobian })
    }

    /// Evaluates ∂F/∂y + c_j ∂F/∂ẏ and returns its entries.
    pub(super) fn evaluate<P: Problem>(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        c_j: f64,
    ) -> (Result<(), StepError>, &[f64]) {
        self.values.fill(0.0);
        let evaluated = self.jacobian.combined(problem, at, (1.0, c_j), &mut self.values);
        (evaluated, &self.values)
    }

    /// Evaluates ∂F/∂y and ∂F/∂ẏ, and returns the entries of ∂F/∂y + c_j ∂F/∂ẏ.
    fn evaluate_parts<P: Problem>(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        c_j: f64,
    ) -> (Result<(), StepError>, &[f64]) {
        let mut df_dyp = vec![0.0; self.values.len()];
        let parts = [&mut self.values[..], &mut df_dyp];
        let evaluated = self.jacobian.parts(problem, at, parts);
        for (value, df_dyp) in self.values.iter_mut().zip(&df_dyp) {
            *value += c_j * df_dyp;
        }
        (evaluated, &self.values)
    }

    /// Solves in place.
    pub(super) fn solve(&mut self, rhs: &mut [f64]) -> Result<(), StepError> {
        match &mut self.factors {
            WholeFactors::Sparse(factors) => factors.solve(rhs)?,
            WholeFactors::Dense(factors) => factors.solve(rhs)?,
        }
        Ok(())
    }

    pub(super) fn factorize(&mut self) -> Result<(), StepError> {
        let rcond = match &mut self.factors {
            WholeFactors::Sparse(factors) => {
                factors.renew(&self.values)?;
                factors.rcond()
            }
            WholeFactors::Dense(factors) => {
                factors.renew(&self.values)?;
                None
            }
        };
        let both = [self.smallest_rcond, rcond];
        self.smallest_rcond = both.into_iter().flatten().reduce(f64::min);
        Ok(())
    }
}

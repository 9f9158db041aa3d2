//! What solves the linear systems of Newton's method.

use myovib_dae::{Jacobian, LinearSolver, Linearization, Problem, StepError};
use myovib_sparse::SparseError;
use myovib_sparse::SparseOptions;
use myovib_sparse::pivoting::{Factors, Symbolic};

/// The linear solver of a problem `P`.
pub(super) enum Linear<P> {
    /// LU of the whole matrix.
    Sparse(Box<SparseLu>),
    /// The user's.
    Own(Box<dyn LinearSolver<P> + Send>),
}

impl<P: Problem> Linear<P> {
    /// Evaluates the matrices at a state, or the one ∂F/∂y + c_j ∂F/∂ẏ where no more is needed: the
    /// entries of which are returned.
    pub(super) fn evaluate(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        c_j: f64,
    ) -> (Result<(), StepError>, &[f64]) {
        match self {
            Self::Sparse(lu) => lu.evaluate(problem, at, c_j),
            Self::Own(solver) => (solver.evaluate(problem, at), &[]),
        }
    }

    /// Factorises ∂F/∂y + c_j ∂F/∂ẏ at the state of the last evaluation.
    pub(super) fn set_up(&mut self, problem: &mut P, c_j: f64) -> Result<(), StepError> {
        match self {
            Self::Sparse(lu) => lu.factorise(),
            Self::Own(solver) => solver.set_up(problem, c_j, &[]),
        }
    }

    /// Solves in place.
    pub(super) fn solve(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        match self {
            Self::Sparse(lu) => lu.solve(rhs),
            Self::Own(solver) => solver.solve_real(problem, rhs),
        }
    }

    /// Evaluations of the residual that the matrices took so far.
    pub(super) fn difference_evaluations(&self) -> u64 {
        match self {
            Self::Sparse(lu) => lu.jacobian.residual_evaluations(),
            Self::Own(solver) => solver.difference_evaluations(),
        }
    }

    /// The smallest condition estimate since the start.
    pub(super) fn smallest_rcond(&self) -> Option<f64> {
        match self {
            Self::Sparse(lu) => lu.smallest_rcond,
            Self::Own(_) => None,
        }
    }

    /// Starts the search for the smallest condition estimate afresh.
    pub(super) fn forget_rcond(&mut self) {
        if let Self::Sparse(lu) = self {
            lu.smallest_rcond = None;
        }
    }
}

/// The Newton matrix, by differences where the problem has none, and its factors.
pub(super) struct SparseLu {
    jacobian: Jacobian,
    values: Vec<f64>,
    factors: Factors<f64>,
    smallest_rcond: Option<f64>,
}

impl SparseLu {
    /// Room for a matrix with the pattern of the Jacobian.
    pub(super) fn new(jacobian: Jacobian, options: SparseOptions) -> Result<Self, SparseError> {
        let symbolic = Symbolic::analyze(jacobian.pattern(), options)?;
        Ok(Self {
            values: vec![0.0; symbolic.nnz()],
            factors: Factors::new(symbolic),
            smallest_rcond: None,
            jacobian,
        })
    }

    /// Evaluates ∂F/∂y + c_j ∂F/∂ẏ, the entries of which are returned.
    pub(super) fn evaluate<P: Problem>(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        c_j: f64,
    ) -> (Result<(), StepError>, &[f64]) {
        self.values.fill(0.0);
        let evaluated = self
            .jacobian
            .combined(problem, at, (1.0, c_j), &mut self.values);
        (evaluated, &self.values)
    }

    /// Solves in place.
    pub(super) fn solve(&mut self, rhs: &mut [f64]) -> Result<(), StepError> {
        Ok(self.factors.solve(rhs)?)
    }

    pub(super) fn factorise(&mut self) -> Result<(), StepError> {
        self.factors.renew(&self.values)?;
        let both = [self.smallest_rcond, self.factors.rcond()];
        self.smallest_rcond = both.into_iter().flatten().reduce(f64::min);
        Ok(())
    }
}

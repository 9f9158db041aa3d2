//! Linear solvers for Newton's method.

use myovib_dae::{
    Complex64, ConsistencyMode, Inconsistent, Jacobian, LinearSolver, Linearization, Problem,
    StepError, VariableKind, correct_initial_values,
};
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
    /// Evaluates ∂F/∂y + c_j ∂F/∂ẏ at a state, and returns the entries of the sum. A linear solver of the user
    /// evaluates the two matrices, and no entries are returned.
    pub(super) fn evaluate(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        c_j: f64,
    ) -> (Result<(), StepError>, &[f64]) {
        match self {
            Self::Whole(lu) => lu.evaluate(problem, at, c_j),
            Self::Own(solver) => (solver.evaluate(problem, at), &[]),
        }
    }

    /// Corrects initial values y and ẏ with [`correct_initial_values`].
    ///
    /// # Errors
    /// Returns [`Inconsistent`] and restores the values.
    pub(super) fn correct(
        &mut self,
        problem: &mut P,
        mode: ConsistencyMode,
        kinds: &[VariableKind],
        times: (f64, f64),
        [y, y_dot]: [&mut [f64]; 2],
        [weights, distance]: [&[f64]; 2],
    ) -> Result<(), Inconsistent> {
        match self {
            Self::Whole(lu) => {
                let nnz = lu.values.len();
                let solver = &mut InParts { lu, df_dy: vec![0.0; nnz], df_dyp: vec![0.0; nnz] };
                correct_initial_values(
                    problem, solver, mode, kinds, times, y, y_dot, weights, distance,
                )
            }
            Self::Own(solver) => correct_initial_values(
                problem, solver, mode, kinds, times, y, y_dot, weights, distance,
            ),
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

/// [`WholeLu`] that evaluates ∂F/∂y and ∂F/∂ẏ separately, before c is known.
struct InParts<'a> {
    lu: &'a mut WholeLu,
    df_dy: Vec<f64>,
    df_dyp: Vec<f64>,
}

impl<P: Problem> LinearSolver<P> for InParts<'_> {
    fn evaluate(&mut self, problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError> {
        self.lu.jacobian.parts(problem, at, [&mut self.df_dy, &mut self.df_dyp])
    }

    fn set_up(&mut self, _: &mut P, real: f64, _: &[Complex64]) -> Result<(), StepError> {
        let parts = self.df_dy.iter().zip(&self.df_dyp);
        for (value, (df_dy, df_dyp)) in self.lu.values.iter_mut().zip(parts) {
            *value = df_dy + real * df_dyp;
        }
        self.lu.factorize()
    }

    fn solve_real(&mut self, _: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        self.lu.solve(rhs)
    }

    fn solve_complex(&mut self, _: &mut P, _: usize, _: &mut [Complex64]) -> Result<(), StepError> {
        unreachable!("BDF has no complex matrices")
    }
}

//! A sparse linear system with factors kept fresh, and a check on what its solutions are worth.

use nalgebra_sparse::pattern::SparsityPattern;
use sundials_wrap::klu::{Factors, KluError, KluOptions, Pivots, Symbolic};

use super::Number;

/// Solutions with a larger backward error are refined. What factors with good pivots leave is a
/// few ε times the length of a row; at 1e-12 four digits are gone, and a refinement, which costs
/// as much as a solve, brings them back.
const REFINE_ABOVE: f64 = 1e-12;

/// Refinements of one solution. The first contracts the error by the backward error before it;
/// if two do not do, more will not.
const MAX_REFINEMENTS: usize = 2;

/// What linear systems cost and how well they were solved.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinearWork {
    /// Factorisations with pivots chosen anew.
    pub factorizations: u64,
    /// Factorisations with the pivots kept.
    pub refactorizations: u64,
    /// Solves.
    pub solves: u64,
    /// Refinements of solutions.
    pub refinements: u64,
    /// The largest componentwise backward error, max_i |b - A x|_i / (|A||x| + |b|)_i, of the
    /// solutions checked: the first after each set-up, and all those refined.
    pub largest_backward_error: f64,
}

/// A matrix with a fixed pattern, its factors and workspace.
#[derive(Debug)]
pub struct SparseSystem<T: Number> {
    pattern: SparsityPattern,
    values: Vec<T>,
    factors: Factors<T>,
    check: bool,
    rhs: Vec<T>,
    residual: Vec<T>,
    scale: Vec<f64>,
}

impl<T: Number> SparseSystem<T> {
    /// Analyses the compressed-column `pattern`.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new(pattern: &SparsityPattern, options: KluOptions) -> Result<Self, KluError> {
        let n = pattern.major_dim();
        Ok(Self {
            factors: Factors::new(Symbolic::analyze(pattern, options)?),
            pattern: pattern.clone(),
            values: vec![T::zero(); pattern.nnz()],
            check: true,
            rhs: vec![T::zero(); n],
            residual: vec![T::zero(); n],
            scale: vec![0.0; n],
        })
    }

    /// The values in the order of the pattern, to be filled before [`renew`](Self::renew).
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Factorises the matrix with the present values.
    ///
    /// # Errors
    /// [`KluError::Singular`] and others of the factorisation.
    pub fn renew(&mut self, work: &mut LinearWork) -> Result<(), KluError> {
        match self.factors.renew(&self.values)? {
            Pivots::Fresh => work.factorizations += 1,
            Pivots::Kept => work.refactorizations += 1,
        }
        self.check = true;
        Ok(())
    }

    /// Solves in place. The first solution with new factors is checked; if it needs refinement,
    /// so do all others with these factors.
    ///
    /// # Errors
    /// Those of the solve.
    pub fn solve(&mut self, x: &mut [T], work: &mut LinearWork) -> Result<(), KluError> {
        work.solves += 1;
        if !self.check {
            return self.factors.solve(x);
        }
        self.rhs.copy_from_slice(x);
        self.factors.solve(x)?;
        let mut error = self.backward_error(x);
        self.check = error > REFINE_ABOVE;
        for _ in 0..MAX_REFINEMENTS {
            if error <= REFINE_ABOVE {
                break;
            }
            work.refinements += 1;
            self.factors.solve(&mut self.residual)?;
            for (x, &correction) in x.iter_mut().zip(&self.residual) {
                *x += correction;
            }
            error = self.backward_error(x);
        }
        work.largest_backward_error = work.largest_backward_error.max(error);
        Ok(())
    }

    /// max_i |b - A x|_i / (|A||x| + |b|)_i; leaves b - A x in `residual`. It does not depend on
    /// the scaling of rows and columns, which here differ by many powers of ten.
    fn backward_error(&mut self, x: &[T]) -> f64 {
        self.residual.copy_from_slice(&self.rhs);
        multiply_subtract(&self.pattern, &self.values, x, &mut self.residual);
        for (scale, b) in self.scale.iter_mut().zip(&self.rhs) {
            *scale = b.abs();
        }
        for ((column, row), a) in self.pattern.entries().zip(&self.values) {
            self.scale[row] += a.abs() * x[column].abs();
        }
        self.residual
            .iter()
            .zip(&self.scale)
            .filter(|(_, scale)| **scale > 0.0)
            .map(|(residual, scale)| residual.abs() / scale)
            .fold(0.0, f64::max)
    }
}

/// `y` -= A `x` for a compressed-column A.
pub(super) fn multiply_subtract<T: Number>(
    pattern: &SparsityPattern,
    values: &[T],
    x: &[T],
    y: &mut [T],
) {
    let offsets = pattern.major_offsets();
    for (window, &x) in offsets.windows(2).zip(x) {
        let column = window[0]..window[1];
        for (&row, &a) in pattern.minor_indices()[column.clone()]
            .iter()
            .zip(&values[column])
        {
            y[row] -= a * x;
        }
    }
}

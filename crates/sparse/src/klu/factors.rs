//! LU factors that keep their pivots as long as the pivots are accurate.

use std::sync::Arc;

use super::Symbolic;
use crate::error::expect_length;
use crate::ffi::klu::RawNumeric;
use crate::finite::expect_finite;
use crate::{Factorization, Scalar, SparseError};

/// New pivots are selected if the reciprocal pivot growth falls below this fraction of the value for new pivots. The
/// old pivots then cost three digits of accuracy.
const GROWTH_LOSS: f64 = 1e-3;

/// Origin of the pivots of a factorization.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pivots {
    /// Newly selected.
    Fresh,
    /// Reused from an earlier matrix. This is several times cheaper than the selection of new pivots.
    Reused,
}

/// Factors of a sequence of matrices with the same pattern.
///
/// `Send`, but not `Sync`: a solve uses internal workspace.
#[derive(Debug)]
pub struct Factors<T: Scalar> {
    symbolic: Symbolic,
    /// The factors, and the reciprocal pivot growth at the time when the pivots were selected.
    numeric: Option<(RawNumeric<T>, f64)>,
    /// Whether the factors belong to the last matrix. If a matrix cannot be factorized, the pivots are kept.
    current: bool,
    /// Number of pivot selections.
    choices: u64,
}

impl<T: Scalar> Factors<T> {
    /// Creates an empty set of factors for matrices with the analyzed pattern.
    pub fn new(symbolic: Symbolic) -> Self {
        Self { symbolic, numeric: None, current: false, choices: 0 }
    }

    /// Returns the number of pivot selections so far. Later matrices reuse selected pivots.
    pub fn pivot_choices(&self) -> u64 {
        self.choices
    }

    /// Makes the next matrix select new pivots.
    pub fn forget_pivots(&mut self) {
        (self.numeric, self.current) = (None, false);
    }

    /// Factorizes the matrix with the given `values`.
    ///
    /// The pivots of the previous matrix are kept unless the pivot growth shows that they would cost more than three
    /// digits compared with new ones.
    ///
    /// # Shapes
    /// `values`: one value per entry of the pattern, in the same order.
    ///
    /// # Errors
    /// Returns [`SparseError::Singular`], [`SparseError::NotFinite`], [`SparseError::WrongLength`] or
    /// [`SparseError::Failed`]. No factors are then available until another matrix is factorized.
    pub fn renew(&mut self, values: &[T]) -> Result<Pivots, SparseError> {
        self.current = false;
        expect_length("values of the matrix", self.symbolic.nnz(), values.len())?;
        expect_finite(values, "matrix")?;
        let pivots = self.factorize(values)?;
        self.current = true;
        Ok(pivots)
    }

    fn factorize(&mut self, values: &[T]) -> Result<Pivots, SparseError> {
        if let Some((numeric, fresh_growth)) = &mut self.numeric
            && numeric.refactor(values).is_ok()
            && numeric.rgrowth(values)? >= GROWTH_LOSS * *fresh_growth
        {
            return Ok(Pivots::Reused);
        }
        let numeric = RawNumeric::factor(Arc::clone(&self.symbolic.raw), values)?;
        let growth = numeric.rgrowth(values)?;
        self.numeric = Some((numeric, growth));
        self.choices += 1;
        Ok(Pivots::Fresh)
    }

    /// Returns the factors of the last matrix.
    fn current(&self) -> Result<&RawNumeric<T>, SparseError> {
        let numeric = self.numeric.as_ref().filter(|_| self.current);
        numeric.map(|(numeric, _)| numeric).ok_or(SparseError::NoFactors)
    }

    /// Returns a cheap estimate of the reciprocal condition number of the last matrix: min |u_kk| / max |u_kk|.
    pub fn rcond(&self) -> Option<f64> {
        self.current().ok()?.rcond().ok()
    }

    /// Solves A x = b in place.
    ///
    /// # Shapes
    /// `rhs`: one right-hand side of length [`n`](Symbolic::n), or several, one after the other.
    ///
    /// # Errors
    /// Returns [`SparseError::WrongLength`] if the length is not a multiple of n, and [`SparseError::NoFactors`] before
    /// the first matrix and after a failed factorization.
    pub fn solve(&self, rhs: &mut [T]) -> Result<(), SparseError> {
        self.solve_either(rhs, false)
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated).
    ///
    /// # Errors
    /// Returns the same errors as [`solve`](Self::solve).
    pub fn solve_transposed(&self, rhs: &mut [T]) -> Result<(), SparseError> {
        self.solve_either(rhs, true)
    }

    fn solve_either(&self, rhs: &mut [T], transposed: bool) -> Result<(), SparseError> {
        let n = self.symbolic.n();
        if !rhs.len().is_multiple_of(n) {
            let what = "right-hand sides (a multiple of the order)";
            return Err(SparseError::WrongLength { what, expected: n, got: rhs.len() });
        }
        self.current()?.solve(rhs, transposed)
    }
}

impl<T: Scalar> Factorization<T> for Factors<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        Self::renew(self, values).map(drop)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve(self, x)
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve_transposed(self, x)
    }

    fn n_entries(&self) -> Option<usize> {
        self.current().ok().map(RawNumeric::n_entries)
    }
}

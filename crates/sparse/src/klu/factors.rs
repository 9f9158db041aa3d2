//! LU factors that keep their pivots as long as these are accurate.

use super::{Numeric, Symbolic};
use crate::{Factorization, Scalar, SparseError};

/// New pivots are chosen if the reciprocal pivot growth falls below this fraction of its value for new pivots. Old
/// pivots then cost three digits of accuracy.
const GROWTH_LOSS: f64 = 1e-3;

/// Origin of the pivots of a factorization.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pivots {
    /// Newly chosen.
    Fresh,
    /// Kept from an earlier matrix, which is several times cheaper than choosing new ones.
    Kept,
}

/// Factors of a sequence of matrices with the same pattern.
#[derive(Debug)]
pub struct Factors<T: Scalar> {
    symbolic: Symbolic,
    /// The factors, and the reciprocal pivot growth when the pivots were chosen.
    numeric: Option<(Numeric<T>, f64)>,
    /// Whether the factors belong to the last matrix. Pivots are kept after a matrix that could not be factorized.
    current: bool,
    /// Number of times that pivots were chosen.
    choices: u64,
}

impl<T: Scalar> Factors<T> {
    /// Creates an empty set of factors for matrices with the analyzed pattern.
    pub fn new(symbolic: Symbolic) -> Self {
        Self { symbolic, numeric: None, current: false, choices: 0 }
    }

    /// Number of pivot choices that later matrices keep.
    pub fn pivot_choices(&self) -> u64 {
        self.choices
    }

    /// Makes the next matrix choose new pivots.
    pub fn forget_pivots(&mut self) {
        (self.numeric, self.current) = (None, false);
    }

    /// Factorizes the matrix with these `values`.
    ///
    /// The pivots of the previous matrix are kept unless the pivot growth shows that they cost more than three digits
    /// compared with new ones.
    ///
    /// # Errors
    /// As for [`Numeric::factor`]. No factors are available then until a matrix is factorized.
    pub fn renew(&mut self, values: &[T]) -> Result<Pivots, SparseError> {
        self.current = false;
        let pivots = self.factorize(values)?;
        self.current = true;
        Ok(pivots)
    }

    fn factorize(&mut self, values: &[T]) -> Result<Pivots, SparseError> {
        if let Some((numeric, fresh_growth)) = &mut self.numeric
            && numeric.refactor(values).is_ok()
            && numeric.rgrowth(values)? >= GROWTH_LOSS * *fresh_growth
        {
            return Ok(Pivots::Kept);
        }
        let numeric = Numeric::factor(&self.symbolic, values)?;
        let growth = numeric.rgrowth(values)?;
        self.numeric = Some((numeric, growth));
        self.choices += 1;
        Ok(Pivots::Fresh)
    }

    /// Returns the factors of the last matrix.
    ///
    /// # Errors
    /// [`SparseError::NoFactors`] before the first matrix and after a failed factorization.
    pub fn current(&self) -> Result<&Numeric<T>, SparseError> {
        self.numeric
            .as_ref()
            .filter(|_| self.current)
            .map(|(numeric, _)| numeric)
            .ok_or(SparseError::NoFactors)
    }

    /// Returns a cheap estimate of the reciprocal condition number of the last matrix; see [`Numeric::rcond`].
    pub fn rcond(&self) -> Option<f64> {
        self.current().ok()?.rcond().ok()
    }

    /// Solves A x = b in place.
    ///
    /// # Errors
    /// As for [`Numeric::solve`].
    pub fn solve(&self, rhs: &mut [T]) -> Result<(), SparseError> {
        self.current()?.solve(rhs)
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated).
    ///
    /// # Errors
    /// As for [`Numeric::solve`].
    pub fn solve_transposed(&self, rhs: &mut [T]) -> Result<(), SparseError> {
        self.current()?.solve_transposed(rhs)
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
        let (lower, upper) = self.current().ok()?.nnz_factors();
        Some(lower + upper)
    }
}

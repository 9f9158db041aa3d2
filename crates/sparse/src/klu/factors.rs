//! LU factors kept fresh: pivots are chosen once and kept as long as they serve.

use super::{Numeric, Symbolic};
use crate::{Factorization, Scalar, SparseError};

/// A reciprocal pivot growth this much below that of fresh pivots calls for fresh ones: three of
/// the digits that fresh pivots would give are lost then.
const GROWTH_LOSS: f64 = 1e-3;

/// How the factors of a matrix were renewed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pivots {
    /// Chosen anew.
    Fresh,
    /// Kept from before, several times cheaper.
    Kept,
}

/// The factors of matrices with one pattern, one after the other.
#[derive(Debug)]
pub struct Factors<T: Scalar> {
    symbolic: Symbolic,
    /// The factors, and the reciprocal pivot growth when the pivots were chosen.
    numeric: Option<(Numeric<T>, f64)>,
    /// Whether they are those of the last matrix: its pivots may outlive one that was refused.
    current: bool,
    /// How often pivots were chosen.
    choices: u64,
}

impl<T: Scalar> Factors<T> {
    /// No factors yet, of matrices with the pattern analysed.
    pub fn new(symbolic: Symbolic) -> Self {
        Self {
            symbolic,
            numeric: None,
            current: false,
            choices: 0,
        }
    }

    /// How often pivots were chosen that later matrices keep.
    pub fn pivot_choices(&self) -> u64 {
        self.choices
    }

    /// Makes the next matrix choose its pivots anew.
    pub fn forget_pivots(&mut self) {
        (self.numeric, self.current) = (None, false);
    }

    /// Factorises the matrix with these `values`.
    ///
    /// The pivots are kept from the matrix before unless the growth of the entries says that they
    /// cost more than three digits beyond what fresh ones did.
    ///
    /// # Errors
    /// As for [`Numeric::factor`]. There is nothing to solve with then until a matrix is factorised.
    pub fn renew(&mut self, values: &[T]) -> Result<Pivots, SparseError> {
        self.current = false;
        let pivots = self.factorise(values)?;
        self.current = true;
        Ok(pivots)
    }

    fn factorise(&mut self, values: &[T]) -> Result<Pivots, SparseError> {
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

    /// The factors of the last matrix.
    ///
    /// # Errors
    /// [`SparseError::NoFactors`] before the first, and after one that could not be factorised.
    pub fn current(&self) -> Result<&Numeric<T>, SparseError> {
        self.numeric
            .as_ref()
            .filter(|_| self.current)
            .map(|(numeric, _)| numeric)
            .ok_or(SparseError::NoFactors)
    }

    /// A cheap estimate of the reciprocal condition number of the last matrix, see
    /// [`Numeric::rcond`].
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

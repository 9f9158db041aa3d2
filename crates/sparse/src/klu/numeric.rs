//! The factors of a matrix.

use std::sync::Arc;

use num_complex::Complex64;

use super::{Symbolic, error};
use crate::error::expect_length;
use crate::ffi::klu::{Failure, RawNumeric};
use crate::finite::expect_finite;
use crate::{Scalar, SparseError};

/// LU factors of a real matrix.
pub type RealNumeric = Numeric<f64>;
/// LU factors of a complex matrix.
pub type ComplexNumeric = Numeric<Complex64>;

/// The LU factors of a real or complex matrix.
///
/// `Send`, but not `Sync`: a solve uses internal workspace.
pub struct Numeric<T: Scalar> {
    symbolic: Symbolic,
    raw: RawNumeric<T>,
    usable: bool,
}

impl<T: Scalar> Numeric<T> {
    /// Factorizes the matrix with the analyzed pattern and these `values`, choosing pivots.
    ///
    /// # Shapes
    /// `values`: one per entry of the pattern, in its order.
    ///
    /// # Errors
    /// [`SparseError::Singular`], [`SparseError::NotFinite`], [`SparseError::WrongLength`] or
    /// [`SparseError::Failed`].
    pub fn factor(symbolic: &Symbolic, values: &[T]) -> Result<Self, SparseError> {
        check_values(symbolic, values)?;
        let raw = RawNumeric::factor(Arc::clone(&symbolic.raw), values)
            .map_err(|failure| error::from_failure(symbolic.n(), failure))?;
        Ok(Self { symbolic: symbolic.clone(), raw, usable: true })
    }

    /// Recomputes the factors for new `values`, keeping the pivots chosen by [`factor`](Numeric::factor). Check
    /// [`rgrowth`](Numeric::rgrowth): after large changes of the values, the old pivots may be inaccurate.
    ///
    /// # Errors
    /// As for [`factor`](Numeric::factor). After [`SparseError::Singular`] no factors are available until another
    /// refactorization succeeds; after other errors the old factors stay valid.
    pub fn refactor(&mut self, values: &[T]) -> Result<(), SparseError> {
        check_values(&self.symbolic, values)?;
        let outcome = self.raw.refactor(values);
        self.usable = outcome.is_ok();
        outcome.map_err(|failure| error::from_failure(self.symbolic.n(), failure))
    }

    /// Solves A x = b in place.
    ///
    /// # Shapes
    /// `rhs`: one right-hand side of length [`n`](Symbolic::n), or several, one after the other.
    ///
    /// # Errors
    /// [`SparseError::WrongLength`] if the length is not a multiple of n, [`SparseError::NoFactors`] after a failed
    /// refactorization.
    pub fn solve(&self, rhs: &mut [T]) -> Result<(), SparseError> {
        self.solve_either(rhs, false)
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated). See [`solve`](Numeric::solve).
    ///
    /// # Errors
    /// As for [`solve`](Numeric::solve).
    pub fn solve_transposed(&self, rhs: &mut [T]) -> Result<(), SparseError> {
        self.solve_either(rhs, true)
    }

    fn solve_either(&self, rhs: &mut [T], transposed: bool) -> Result<(), SparseError> {
        let n = self.symbolic.n();
        if !rhs.len().is_multiple_of(n) {
            let what = "right-hand sides (a multiple of the order)";
            return Err(SparseError::WrongLength { what, expected: n, got: rhs.len() });
        }
        self.usable()?;
        self.checked(self.raw.solve(rhs, transposed))
    }

    /// Returns a cheap estimate of the reciprocal condition number: min |u_kk| / max |u_kk|.
    ///
    /// # Errors
    /// [`SparseError::NoFactors`] after a failed refactorization.
    pub fn rcond(&self) -> Result<f64, SparseError> {
        self.usable()?;
        self.checked(self.raw.rcond())
    }

    /// Returns the reciprocal pivot growth, min over the columns j of max |a_ij| / max |u_ij|. It is near 1 after a
    /// stable elimination and very small after an unstable one.
    ///
    /// # Errors
    /// [`SparseError::WrongLength`] for the `values` of another pattern, [`SparseError::NoFactors`].
    pub fn rgrowth(&self, values: &[T]) -> Result<f64, SparseError> {
        check_values(&self.symbolic, values)?;
        self.usable()?;
        self.checked(self.raw.rgrowth(values))
    }

    /// Returns the number of entries of L and of U, including both diagonals but not the off-diagonal blocks.
    pub fn nnz_factors(&self) -> (usize, usize) {
        self.raw.nnz_factors()
    }

    fn usable(&self) -> Result<(), SparseError> {
        if self.usable { Ok(()) } else { Err(SparseError::NoFactors) }
    }

    fn checked<R>(&self, result: Result<R, Failure>) -> Result<R, SparseError> {
        result.map_err(|failure| error::from_failure(self.symbolic.n(), failure))
    }
}

impl<T: Scalar> std::fmt::Debug for Numeric<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Numeric")
            .field("symbolic", &self.symbolic)
            .field("nnz_factors", &self.nnz_factors())
            .field("usable", &self.usable)
            .finish()
    }
}

fn check_values<T: Scalar>(symbolic: &Symbolic, values: &[T]) -> Result<(), SparseError> {
    expect_length("values of the matrix", symbolic.nnz(), values.len())?;
    expect_finite(values, "matrix")
}

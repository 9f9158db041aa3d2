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

/// The LU factors of a matrix, of real or complex numbers.
///
/// `Send`, but not `Sync`: a solve uses workspace inside.
pub struct Numeric<T: Scalar> {
    symbolic: Symbolic,
    raw: RawNumeric<T>,
    usable: bool,
}

impl<T: Scalar> Numeric<T> {
    /// Factorises the matrix with the analysed pattern and these `values`, choosing pivots.
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
        Ok(Self {
            symbolic: symbolic.clone(),
            raw,
            usable: true,
        })
    }

    /// Recomputes the factors for new `values`, keeping the pivots chosen by
    /// [`factor`](Numeric::factor). Watch [`rcond`](Numeric::rcond): when the values have changed
    /// much, the old pivots may be poor and a fresh `factor` is due.
    ///
    /// # Errors
    /// As for [`factor`](Numeric::factor). After [`SparseError::Singular`] there are no factors until
    /// another refactorisation succeeds; the other errors leave the old ones in place.
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
    /// [`SparseError::WrongLength`] for a length that is no multiple of n, [`SparseError::NoFactors`]
    /// after a failed refactorisation.
    pub fn solve(&self, rhs: &mut [T]) -> Result<(), SparseError> {
        self.solve_either(rhs, false)
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated); otherwise as
    /// [`solve`](Numeric::solve).
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
            return Err(SparseError::WrongLength {
                what,
                expected: n,
                got: rhs.len(),
            });
        }
        self.usable()?;
        self.checked(self.raw.solve(rhs, transposed))
    }

    /// Cheap estimate of the reciprocal condition number: min |u_kk| / max |u_kk|.
    ///
    /// # Errors
    /// [`SparseError::NoFactors`] after a failed refactorisation.
    pub fn rcond(&self) -> Result<f64, SparseError> {
        self.usable()?;
        self.checked(self.raw.rcond())
    }

    /// Estimate of the condition number in the 1-norm (Hager, Higham): a few solves.
    ///
    /// # Errors
    /// [`SparseError::WrongLength`] for the `values` of another pattern, [`SparseError::NoFactors`].
    pub fn condest(&self, values: &[T]) -> Result<f64, SparseError> {
        check_values(&self.symbolic, values)?;
        self.usable()?;
        self.checked(self.raw.condest(values))
    }

    /// Reciprocal pivot growth, min over the columns j of max |a_ij| / max |u_ij|: near 1 when the
    /// elimination was stable, tiny when it was not.
    ///
    /// # Errors
    /// As for [`condest`](Numeric::condest).
    pub fn rgrowth(&self, values: &[T]) -> Result<f64, SparseError> {
        check_values(&self.symbolic, values)?;
        self.usable()?;
        self.checked(self.raw.rgrowth(values))
    }

    /// Entries of L and of U (the diagonal of each included), off-diagonal blocks left out.
    pub fn nnz_factors(&self) -> (usize, usize) {
        self.raw.nnz_factors()
    }

    /// Floating-point operations of one factorisation.
    ///
    /// # Errors
    /// [`SparseError::NoFactors`] after a failed refactorisation.
    pub fn flops(&self) -> Result<f64, SparseError> {
        self.usable()?;
        self.checked(self.raw.flops())
    }

    /// The analysis these factors belong to.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    fn usable(&self) -> Result<(), SparseError> {
        if self.usable {
            Ok(())
        } else {
            Err(SparseError::NoFactors)
        }
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

//! LU factorization of any sparse matrix with partial pivoting by faer, without a C library.

use crate::error::expect_length;
use crate::finite::expect_finite;
use crate::lu::{Lu, Symbolic};
use crate::{Factorization, Scalar, SparseError};

/// Factors of a sequence of matrices with the same pattern. New pivots are selected for each matrix.
pub struct Factors<T: Scalar> {
    lu: Lu<T>,
    probe: Vec<T>,
    /// Whether the factors belong to the last matrix passed to `renew`.
    current: bool,
}

impl<T: Scalar> Factors<T> {
    /// Creates an empty set of factors for matrices with the analyzed pattern.
    pub fn new(symbolic: Symbolic) -> Self {
        Self { probe: vec![T::zero(); symbolic.n()], lu: T::lu(symbolic), current: false }
    }

    /// Returns the number of pivot selections that later matrices reuse, which is always zero.
    pub fn pivot_choices(&self) -> u64 {
        0
    }

    /// Has no effect, since new pivots are selected for each matrix.
    pub fn forget_pivots(&mut self) {}

    /// Factorizes the matrix with the given `values`.
    ///
    /// # Errors
    /// Returns [`SparseError::WrongLength`], [`SparseError::NotFinite`] or [`SparseError::Singular`].
    pub fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        self.current = false;
        let (n, nnz) = (self.lu.symbolic().n(), self.lu.symbolic().nnz());
        expect_length("values of the matrix", nnz, values.len())?;
        expect_finite(values, "matrix")?;
        let singular = SparseError::Singular { n, column: None };
        T::factor_lu(&mut self.lu, values).ok_or(singular.clone())?;
        // faer does not report a zero pivot, but the solution then contains infinities.
        self.current = true;
        let mut probe = std::mem::take(&mut self.probe);
        probe.fill(T::one());
        let solved = self.solve(&mut probe);
        self.current = solved.is_ok() && expect_finite(&probe, "solution").is_ok();
        self.probe = probe;
        if self.current { Ok(()) } else { Err(singular) }
    }

    /// Returns `None`: faer does not estimate the reciprocal condition number.
    pub fn rcond(&self) -> Option<f64> {
        None
    }

    /// Solves A x = b in place.
    ///
    /// # Errors
    /// Returns [`SparseError::NoFactors`] or [`SparseError::WrongLength`].
    pub fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.check(x)?;
        T::solve_lu(&mut self.lu, x, false);
        Ok(())
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated).
    ///
    /// # Errors
    /// Returns the same errors as [`solve`](Self::solve).
    pub fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.check(x)?;
        T::solve_lu(&mut self.lu, x, true);
        Ok(())
    }

    /// Checks the length of `x` and whether factors are available.
    fn check(&self, x: &[T]) -> Result<(), SparseError> {
        expect_length("right-hand side", self.lu.symbolic().n(), x.len())?;
        match self.current {
            true => Ok(()),
            false => Err(SparseError::NoFactors),
        }
    }
}

impl<T: Scalar> std::fmt::Debug for Factors<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Factors")
            .field("n", &self.lu.symbolic().n())
            .field("current", &self.current)
            .finish_non_exhaustive()
    }
}

impl<T: Scalar> Factorization<T> for Factors<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        Self::renew(self, values)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve(self, x)
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve_transposed(self, x)
    }

    fn n_entries(&self) -> Option<usize> {
        None
    }
}

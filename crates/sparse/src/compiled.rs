//! Public methods of products and factors. They call the kernels that are instantiated for each [`Scalar`].

use crate::product::Product;
use crate::supernodal::Supernodal;
use crate::{Factorization, Number, Scalar, SparseError};

impl Product {
    /// Subtracts A x: `y` -= A `x`. `values` contains the entries of A in the order of the pattern.
    pub fn subtract<T: Scalar>(&self, values: &[T], x: &[T], y: &mut [T]) {
        T::subtract(self, values, x, y);
    }

    /// Subtracts A X: Y -= A X. X and Y are stored by rows.
    pub fn subtract_columns<T: Scalar>(
        &self,
        values: &[T],
        x: &[T],
        y: &mut [T],
        n_columns: usize,
    ) {
        match n_columns {
            1 => self.subtract(values, x, y),
            _ => T::subtract_columns(self, values, x, y, n_columns),
        }
    }

    /// Subtracts Aᵀ x (transposed, not conjugated): `y` -= Aᵀ `x`.
    pub fn subtract_transposed<T: Scalar>(&self, values: &[T], x: &[T], y: &mut [T]) {
        T::subtract_transposed(self, values, x, y);
    }

    /// Subtracts Aᵀ X (transposed, not conjugated): Y -= Aᵀ X. X and Y are stored by rows.
    pub fn subtract_transposed_columns<T: Scalar>(
        &self,
        values: &[T],
        x: &[T],
        y: &mut [T],
        n_columns: usize,
    ) {
        T::subtract_transposed_columns(self, values, x, y, n_columns);
    }

    /// Adds |A| |x| to `y`.
    pub(crate) fn add_magnitudes<T: Scalar>(&self, values: &[T], x: &[T], y: &mut [f64]) {
        T::add_magnitudes(self, values, x, y);
    }
}

impl<T: Number> Supernodal<T> {
    /// Factorizes the matrix with the given `values`, in the order of the analyzed pattern.
    ///
    /// # Errors
    /// Returns [`SparseError::ZeroPivot`] if a pivot is zero or not finite; no factors are available then.
    pub fn factor(&mut self, values: &[T]) -> Result<(), SparseError> {
        T::factor(self, values)
    }

    /// Solves A x = b in place with the last factors.
    pub fn solve(&mut self, rhs: &mut [T]) {
        T::solve_by_blocks(self, rhs, false);
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated) with the last factors.
    pub fn solve_transposed(&mut self, rhs: &mut [T]) {
        T::solve_by_blocks(self, rhs, true);
    }
}

impl<T: Scalar> Supernodal<T> {
    /// Solves A X = B in place with the last factors. B is stored by rows.
    pub fn solve_columns(&mut self, rhs: &mut [T], n_columns: usize) {
        T::solve_columns_by_blocks(self, rhs, n_columns);
    }
}

impl<T: Scalar> Factorization<T> for Supernodal<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        self.factor(values)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve(self, x);
        Ok(())
    }

    fn solve_columns(&mut self, x: &mut [T], n_columns: usize) -> Result<(), SparseError> {
        Self::solve_columns(self, x, n_columns);
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve_transposed(self, x);
        Ok(())
    }

    fn pivots(&self) -> Option<Vec<T>> {
        Some(self.pivots_by_unknown())
    }

    fn n_entries(&self) -> Option<usize> {
        Some(self.n_factors())
    }
}

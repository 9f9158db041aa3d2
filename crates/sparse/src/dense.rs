//! LU factorization of full matrices with partial pivoting, by faer's blocked kernels.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Conj, Mat, MatMut, MatRef, Par};

use crate::SparseError;
use crate::error::expect_length;
use crate::finite::expect_finite;

/// Factors of full matrices of a fixed order.
pub struct DenseLu {
    factors: Mat<f64>,
    /// Permutation of the rows, and its inverse.
    permutation: [Vec<usize>; 2],
    buffer: MemBuffer,
    /// Whether the factors belong to the last matrix passed to `renew`.
    is_current: bool,
}

impl std::fmt::Debug for DenseLu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DenseLu")
            .field("n", &self.n())
            .field("is_current", &self.is_current)
            .finish_non_exhaustive()
    }
}

impl DenseLu {
    /// Allocates factors for matrices of order `n`.
    pub fn new(n: usize) -> Self {
        let requirements = StackReq::any_of(&[
            factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default()),
            solve::solve_in_place_scratch::<usize, f64>(n, 1, Par::Seq),
        ]);
        Self {
            factors: Mat::zeros(n, n),
            permutation: [vec![0; n], vec![0; n]],
            buffer: MemBuffer::new(requirements),
            is_current: false,
        }
    }

    fn n(&self) -> usize {
        self.factors.nrows()
    }

    /// Factorizes the matrix with the given `values`, stored column by column.
    ///
    /// # Errors
    /// Returns [`SparseError::WrongLength`], [`SparseError::NotFinite`] or [`SparseError::Singular`].
    pub fn renew(&mut self, values: &[f64]) -> Result<(), SparseError> {
        self.is_current = false;
        let n = self.n();
        expect_length("values of the matrix", n * n, values.len())?;
        expect_finite(values, "matrix")?;
        let matrix = MatRef::from_column_major_slice(values, n, n);
        self.factors.copy_from(matrix);
        let [rows, inverse] = &mut self.permutation;
        let stack = MemStack::new(&mut self.buffer);
        let factors = self.factors.as_mut();
        factor::lu_in_place(factors, rows, inverse, Par::Seq, stack, Default::default());
        let pivots = (0..n).map(|i| self.factors[(i, i)]);
        match pivots.into_iter().position(|p| p == 0.0 || !p.is_finite()) {
            Some(column) => Err(SparseError::Singular { n, column: Some(column) }),
            None => {
                self.is_current = true;
                Ok(())
            }
        }
    }

    /// Solves A x = b in place.
    ///
    /// # Errors
    /// Returns [`SparseError::NoFactors`] or [`SparseError::WrongLength`].
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), SparseError> {
        let n = self.n();
        expect_length("right-hand side", n, x.len())?;
        if !self.is_current {
            return Err(SparseError::NoFactors);
        }
        let [rows, inverse] = &self.permutation;
        let permutation = PermRef::new_checked(rows, inverse, n);
        let rhs = MatMut::from_column_major_slice_mut(x, n, 1);
        let (factors, stack) = (self.factors.as_ref(), MemStack::new(&mut self.buffer));
        solve::solve_in_place_with_conj(
            factors,
            factors,
            permutation,
            Conj::No,
            rhs,
            Par::Seq,
            stack,
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: sparse LU was used for full matrices, and its scalar loops took seconds.
    #[test]
    fn solutions_have_a_small_backward_error() {
        for n in [1, 2, 17, 200] {
            let entry = |i: usize, j: usize| ((i * 7 + j * 13) % 11) as f64 - 5.0;
            let diagonal = |i, j| if i == j { 0.0 } else { entry(i, j) };
            let shifted = |i: usize, j: usize| diagonal(i, (j + 1) % n) + 30.0 * f64::from(i == j);
            let values: Vec<f64> = (0..n * n).map(|k| shifted(k % n, k / n)).collect();
            let b: Vec<f64> = (0..n).map(|i| i as f64 - 3.0).collect();
            let mut lu = DenseLu::new(n);
            lu.renew(&values).unwrap();
            let mut x = b.clone();
            lu.solve(&mut x).unwrap();
            for i in 0..n {
                let terms: Vec<f64> = (0..n).map(|j| values[i + j * n] * x[j]).collect();
                let (sum, size) = terms
                    .iter()
                    .fold((0.0, b[i].abs()), |(sum, size), term| (sum + term, size + term.abs()));
                // The tolerance covers the rounding errors of n terms. The pivots of these matrices grow little.
                let rounding = 10.0 * n as f64 * f64::EPSILON * size;
                assert!((sum - b[i]).abs() <= rounding, "{n} {i}: {sum} {}", b[i]);
            }
        }
    }

    #[test]
    fn singular_matrices_and_wrong_lengths_are_refused() {
        let mut lu = DenseLu::new(2);
        assert!(matches!(lu.solve(&mut [1.0; 2]), Err(SparseError::NoFactors)));
        let singular = lu.renew(&[1.0, 2.0, 2.0, 4.0]);
        assert!(matches!(singular, Err(SparseError::Singular { .. })), "{singular:?}");
        assert!(matches!(lu.renew(&[1.0; 3]), Err(SparseError::WrongLength { .. })));
        assert!(matches!(lu.renew(&[f64::NAN; 4]), Err(SparseError::NotFinite { .. })));
    }
}

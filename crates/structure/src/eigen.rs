//! Eigenvalues and eigenvectors of dense symmetric matrices.

use nalgebra::{DMatrix, DVector};

/// Returns the eigenvalues of a nonempty symmetric matrix, and its orthonormal eigenvectors as columns in the same
/// order.
///
/// nalgebra 0.33 computes wrong eigenvectors for some matrices, so a later version is used here.
pub(crate) fn symmetric_eigen(matrix: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let n = matrix.nrows();
    let eigen =
        nalgebra_eigen::DMatrix::from_column_slice(n, n, matrix.as_slice()).symmetric_eigen();
    (
        DVector::from_column_slice(eigen.eigenvalues.as_slice()),
        DMatrix::from_column_slice(n, n, eigen.eigenvectors.as_slice()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the errors of eigenvectors of nalgebra 0.33 exceeded the bound.
    #[test]
    fn indefinite_matrices_have_right_eigenvectors() {
        for n in [4, 8, 12, 16, 20] {
            for seed in 1..100 {
                let irrational = f64::from(seed).sqrt() + std::f64::consts::PI;
                let entry = |i: usize, j: usize| ((i * i + 3 * j + 1) as f64 * irrational).fract();
                let q = DMatrix::from_fn(n, n, |i, j| entry(i, j) - 0.5).qr().q();
                // One negative eigenvalue has the largest magnitude; the magnitudes of the others decay.
                let values = DVector::from_fn(n, |i, _| match i {
                    0 => -1.0,
                    _ => 10.0_f64.powf(-0.3 * i as f64),
                });
                let a = &q * DMatrix::from_diagonal(&values) * q.transpose();
                let a = (&a + a.transpose()) * 0.5;
                let (eigenvalues, v) = symmetric_eigen(&a);
                // Backward stable methods have residuals of order n ε.
                let residual = (&a * &v - &v * DMatrix::from_diagonal(&eigenvalues)).amax();
                assert!(residual < 1e-13, "{n} {seed}: {residual:e}");
            }
        }
    }
}

//! Singular values and left singular vectors by one-sided Jacobi rotations.
//!
//! The rank decisions and kernel bases rely on these values, so they must be accurate to rounding for every
//! matrix, in particular for rank-deficient matrices. Jacobi rotations satisfy this requirement and compute small
//! singular values to high relative accuracy. First, a QR decomposition with column pivoting yields M Π = Q R.
//! Then the columns of Rᵀ are rotated until they are orthogonal: Rᵀ J = V Σ. This yields M Π = (Q J) Σ Vᵀ. With
//! pivoting, few rotations are necessary (Drmač and Veselić, SIAM J. Matrix Anal. Appl. 29 (2008) 1322).

use nalgebra::DMatrix;

/// Two columns count as orthogonal if the cosine of their angle is below this value times √n.
const ORTHOGONAL: f64 = f64::EPSILON;
/// Maximum number of sweeps over all pairs. Convergence is quadratic; about five sweeps are sufficient.
const MAX_SWEEPS: usize = 60;

/// Returns the singular values of a square matrix in descending order, and the matrix U with its columns in the
/// same order.
pub(crate) fn left_svd(matrix: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let n = matrix.nrows();
    let qr = matrix.clone().col_piv_qr();
    let mut x = qr.r().transpose();
    let mut u = qr.q();
    let tolerance = ORTHOGONAL * (n as f64).sqrt();
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                if let Some((cosine, sine)) = rotation(&x, p, q, tolerance) {
                    rotate(&mut x, p, q, cosine, sine);
                    rotate(&mut u, p, q, cosine, sine);
                    rotated = true;
                }
            }
        }
        if !rotated {
            break;
        }
    }
    let norms: Vec<f64> = x.column_iter().map(|column| column.norm()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    (order.iter().map(|&i| norms[i]).collect(), u.select_columns(&order))
}

/// Returns the rotation (cos, sin) that makes columns p and q orthogonal, or `None` if they already are.
fn rotation(x: &DMatrix<f64>, p: usize, q: usize, tolerance: f64) -> Option<(f64, f64)> {
    let (left, right) = (x.column(p), x.column(q));
    let (pp, qq, pq) = (left.norm_squared(), right.norm_squared(), left.dot(&right));
    if pq.abs() <= tolerance * (pp.sqrt() * qq.sqrt()) {
        return None;
    }
    let cotangent = (qq - pp) / (2.0 * pq);
    let tangent = cotangent.signum() / (cotangent.abs() + cotangent.hypot(1.0));
    let cosine = tangent.hypot(1.0).recip();
    Some((cosine, cosine * tangent))
}

/// Replaces the columns x_p and x_q (p < q) by c x_p − s x_q and s x_p + c x_q, where c is the cosine and s the sine.
fn rotate(x: &mut DMatrix<f64>, p: usize, q: usize, cosine: f64, sine: f64) {
    let n = x.nrows();
    let (head, tail) = x.as_mut_slice().split_at_mut(q * n);
    for (left, right) in head[p * n..(p + 1) * n].iter_mut().zip(&mut tail[..n]) {
        (*left, *right) = (cosine * *left - sine * *right, sine * *left + cosine * *right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// Asserts that a residual consists of rounding errors. Products with n terms of magnitude one have errors of
    /// at most n² ε.
    fn assert_small(residual: &DMatrix<f64>, n: usize) {
        assert!(residual.amax() < (n * n) as f64 * f64::EPSILON, "{residual:.1e}");
    }

    /// Checks that the left kernel is accurate to rounding for any rank.
    #[test]
    fn rank_deficient_matrices() {
        for (n, rank) in [(1, 0), (3, 1), (3, 2), (7, 4), (30, 13), (30, 30)] {
            let wave = |i: usize, j: usize| ((i * i + 3 * j + i * j) as f64).sin();
            let left = DMatrix::from_fn(n, n, wave).qr().q();
            let right = DMatrix::from_fn(n, n, |i, j| wave(j, i + 1)).qr().q();
            let expected =
                DVector::from_fn(n, |i, _| if i < rank { 0.8f64.powi(i as i32) } else { 0.0 });
            let matrix = left * DMatrix::from_diagonal(&expected) * right;
            let (values, u) = left_svd(&matrix);
            assert_small(&(u.tr_mul(&u) - DMatrix::identity(n, n)), n);
            assert_small(&u.columns(rank, n - rank).tr_mul(&matrix).resize(n, n, 0.0), n);
            assert_small(
                &DMatrix::from_column_slice(n, 1, &values)
                    .map_with_location(|i, _, v| v - expected[i]),
                n,
            );
        }
    }
}

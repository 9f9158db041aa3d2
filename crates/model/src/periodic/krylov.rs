//! Matrix-free Krylov methods.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::error::ModelError;

/// A function that computes the product of a matrix with a vector.
pub(super) type Product<'a> = dyn FnMut(&[f64]) -> Result<Vec<f64>, ModelError> + 'a;

/// A Krylov space is considered invariant if the norm of a new basis vector, relative to the product from which it is
/// computed, is below this value.
const INVARIANT: f64 = 1e-13;

/// Orthonormal basis V of a Krylov space, and the matrix H for which A V_k = V_(k+1) H.
struct Arnoldi {
    basis: Vec<Vec<f64>>,
    columns: Vec<Vec<f64>>,
    is_invariant: bool,
}

impl Arnoldi {
    /// Starts the basis with the direction of a nonzero vector.
    fn new(start: &[f64]) -> Self {
        let size = norm(start);
        Self {
            basis: vec![start.iter().map(|x| x / size).collect()],
            columns: Vec::new(),
            is_invariant: false,
        }
    }

    /// Extends the basis by the product with the last basis vector.
    fn extend(&mut self, product: &mut Product<'_>) -> Result<(), ModelError> {
        let mut next = product(&self.basis[self.columns.len()])?;
        let size = norm(&next);
        let mut column = vec![0.0; self.basis.len() + 1];
        // The second pass removes rounding errors of the first.
        for _pass in 0..2 {
            for (h, v) in column.iter_mut().zip(&self.basis) {
                let share = dot(v, &next);
                *h += share;
                next.iter_mut().zip(v).for_each(|(x, v)| *x -= share * v);
            }
        }
        let left = norm(&next);
        self.is_invariant = left <= INVARIANT * size;
        if !self.is_invariant {
            column[self.basis.len()] = left;
            self.basis.push(next.into_iter().map(|x| x / left).collect());
        }
        self.columns.push(column);
        Ok(())
    }

    /// Returns H with k + 1 rows and k columns.
    fn hessenberg(&self) -> DMatrix<f64> {
        let k = self.columns.len();
        DMatrix::from_fn(k + 1, k, |i, j| self.columns[j].get(i).copied().unwrap_or(0.0))
    }
}

/// Solves A x = b by GMRES to the relative residual `tolerance`, with at most `most` products.
pub(super) fn gmres(
    product: &mut Product<'_>,
    b: &[f64],
    tolerance: f64,
    most: usize,
) -> Result<Vec<f64>, ModelError> {
    let size = norm(b);
    if size == 0.0 {
        return Ok(vec![0.0; b.len()]);
    }
    let mut space = Arnoldi::new(b);
    loop {
        space.extend(product)?;
        let (h, k) = (space.hessenberg(), space.columns.len());
        let mut right = DVector::zeros(k + 1);
        right[0] = size;
        let solved = h.clone().svd(true, true).solve(&right, 0.0);
        let shares = solved.unwrap_or_else(|_| DVector::zeros(k));
        let left = (right - h * &shares).norm();
        if left <= tolerance * size || space.is_invariant || k == most {
            let mut x = vec![0.0; b.len()];
            for (share, v) in shares.iter().zip(&space.basis) {
                x.iter_mut().zip(v).for_each(|(x, v)| *x += share * v);
            }
            return Ok(x);
        }
    }
}

/// Computes the `count` eigenvalues of largest magnitude and their residual norms by Arnoldi's method, with at most
/// `most` products. If the last eigenvalue is complex, its conjugate is included. The iteration ends when all residuals
/// are below `tolerance` times the largest magnitude.
pub(super) fn eigenvalues(
    product: &mut Product<'_>,
    start: &[f64],
    count: usize,
    tolerance: f64,
    most: usize,
) -> Result<Vec<(Complex64, f64)>, ModelError> {
    let mut space = Arnoldi::new(start);
    loop {
        space.extend(product)?;
        let k = space.columns.len();
        let h = space.hessenberg();
        let next = h[(k, k - 1)];
        let square = h.rows(0, k).into_owned();
        let values = square.complex_eigenvalues();
        let mut values: Vec<Complex64> = values.iter().copied().collect();
        values.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
        let cut = match values.get(count.wrapping_sub(1)) {
            Some(last) if last.im > 0.0 => count + 1,
            _ => count,
        };
        values.truncate(cut);
        let with_residual = |value: &Complex64| (*value, next * last_component(&square, *value));
        let found: Vec<(Complex64, f64)> = values.iter().map(with_residual).collect();
        let largest = values.first().map_or(0.0, |value| value.norm());
        let is_resolved = k > count && found.iter().all(|(_, left)| *left <= tolerance * largest);
        if is_resolved || space.is_invariant || k == most {
            return Ok(found);
        }
    }
}

/// Returns the magnitude of the last component of the unit eigenvector for the eigenvalue `value`.
fn last_component(matrix: &DMatrix<f64>, value: Complex64) -> f64 {
    let n = matrix.nrows();
    let mut shifted = matrix.map(|x| Complex64::new(x, 0.0));
    for i in 0..n {
        shifted[(i, i)] -= value;
    }
    let rows = shifted.svd(false, true).v_t;
    // The singular values are in descending order.
    rows.map_or(1.0, |rows| rows[(n - 1, n - 1)].norm())
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A nonsymmetric matrix with eigenvalues 0.9, 0.5 ± 0.5 i, 0.2 and zeros.
    fn product(v: &[f64]) -> Result<Vec<f64>, ModelError> {
        let mut out = vec![0.0; v.len()];
        out[0] = 0.9 * v[0] + v[1];
        out[1] = 0.5 * v[1] - 0.5 * v[2];
        out[2] = 0.5 * v[1] + 0.5 * v[2] + 3.0 * v[3];
        out[3] = 0.2 * v[3];
        Ok(out)
    }

    #[test]
    fn leading_eigenvalues_are_found_with_their_conjugates() {
        let start: Vec<f64> = (0..8).map(|i| 1.0 + f64::from(i).sin()).collect();
        let found = eigenvalues(&mut |v| product(v), &start, 2, 1e-10, 8).unwrap();
        let expected = [(0.9, 0.0), (0.5, 0.5), (0.5, -0.5)];
        assert_eq!(found.len(), 3);
        for ((value, left), (re, im)) in found.into_iter().zip(expected) {
            // The condition number of about 100 amplifies rounding errors.
            assert!((value - Complex64::new(re, im)).norm() < 1e-12, "{value}");
            assert!(left < 1e-10);
        }
    }

    #[test]
    fn systems_are_solved_to_the_tolerance() {
        let mut minus_one = |v: &[f64]| {
            let mut out = product(v)?;
            out.iter_mut().zip(v).for_each(|(out, v)| *out -= v);
            Ok(out)
        };
        let b: Vec<f64> = (0..8).map(|i| f64::from(i).cos()).collect();
        let x = gmres(&mut minus_one, &b, 1e-10, 8).unwrap();
        let image = minus_one(&x).unwrap();
        let left: Vec<f64> = image.iter().zip(&b).map(|(a, b)| a - b).collect();
        assert!(norm(&left) < 1e-10 * norm(&b));
    }
}

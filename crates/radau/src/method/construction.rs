//! Construction of the coefficients of a method from the number of stages.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::{ComplexMode, RealMode};

/// Returns the coefficients of Π (1 − θ/c_i) in ascending powers.
pub(super) fn start_basis(nodes: &[f64]) -> Vec<f64> {
    let mut product = vec![1.0];
    for c in nodes {
        product.push(0.0);
        for k in (1..product.len()).rev() {
            product[k] -= product[k - 1] / c;
        }
    }
    product
}

/// Returns the coefficients of the derivative of a polynomial.
pub(super) fn derivative(polynomial: &[f64]) -> Vec<f64> {
    let powers = polynomial.iter().enumerate().skip(1);
    powers.map(|(k, a)| k as f64 * a).collect()
}

/// Returns the coefficients of ∫_0^θ ℓ_0 in ascending powers of θ. The result is empty for one stage.
pub(super) fn ramp(start_basis: &[f64]) -> Vec<f64> {
    if start_basis.len() == 2 {
        return Vec::new();
    }
    let powers = start_basis.iter().enumerate();
    powers.map(|(k, a)| a / (k as f64 + 1.0)).collect()
}

/// Returns the nodes on [0, 1]. They are computed from the eigenvalues of the Jacobi matrix of the Legendre
/// polynomials, with the last diagonal entry changed so that 1 is a node (Golub 1973).
pub(super) fn radau_nodes(stages: usize) -> Vec<f64> {
    let s = stages as f64;
    let jacobi = DMatrix::from_fn(stages, stages, |i, j| {
        let k = i.max(j) as f64;
        match i.abs_diff(j) {
            1 => k / (4.0 * k * k - 1.0).sqrt(),
            0 if i + 1 == stages => s / (2.0 * s - 1.0),
            _ => 0.0,
        }
    });
    let mut nodes: Vec<f64> =
        jacobi.symmetric_eigenvalues().iter().map(|x| 0.5 * (1.0 + x)).collect();
    nodes.sort_by(f64::total_cmp);
    nodes[stages - 1] = 1.0;
    nodes
}

pub(super) fn lagrange(nodes: &[f64], j: usize, theta: f64) -> f64 {
    let c_j = nodes[j];
    others(nodes, j).fold(theta / c_j, |product, c| product * (theta - c) / (c_j - c))
}

/// Returns Σ_m Π_{k ≠ m} (θ − x_k) / Π_k (x_j − x_k), where m and k run over all nodes except c_j.
pub(super) fn lagrange_derivative(nodes: &[f64], j: usize, theta: f64) -> f64 {
    let c_j = nodes[j];
    let scale = others(nodes, j).fold(c_j, |product, c| product * (c_j - c));
    // Apply the product rule, one factor at a time: (f g)' = f' g + f g'.
    let (_, derivative) =
        others(nodes, j).fold((theta, 1.0), |(f, df), c| (f * (theta - c), df * (theta - c) + f));
    derivative / scale
}

fn others(nodes: &[f64], j: usize) -> impl Iterator<Item = f64> {
    nodes.iter().enumerate().filter(move |&(k, _)| k != j).map(|(_, &c)| c)
}

/// Returns the last row b of A, computed from b A⁻¹ = e_s.
pub(super) fn weights(a_inverse: &DMatrix<f64>) -> Vec<f64> {
    let s = a_inverse.nrows();
    let mut weights = DVector::zeros(s);
    weights[s - 1] = 1.0;
    let solved = a_inverse.transpose().lu().solve_mut(&mut weights);
    assert!(solved, "A has an inverse");
    weights.iter().copied().collect()
}

/// Returns the eigenvalues of A⁻¹ with their right and left eigenvectors.
pub(super) fn modes(a_inverse: &DMatrix<f64>) -> (RealMode, Vec<ComplexMode>) {
    let mut eigenvalues: Vec<Complex64> = a_inverse.complex_eigenvalues().iter().copied().collect();
    // Sorting by the imaginary part places conjugate pairs symmetrically around the single real eigenvalue.
    eigenvalues.sort_by(|a, b| a.im.total_cmp(&b.im));
    let middle = eigenvalues.len() / 2;
    let matrix = a_inverse.map(Complex64::from);
    let dot = |l: &[Complex64], r: &[Complex64]| -> Complex64 {
        l.iter().zip(r).map(|(l, r)| l * r).sum()
    };
    let mode = |mut lambda: Complex64| {
        // The quotient ℓ·(A⁻¹ r)/ℓ·r doubles the number of correct digits of an eigenvalue.
        for _ in 0..2 {
            let left = null_vector(&matrix.transpose(), lambda);
            let right = null_vector(&matrix, lambda);
            let image = &matrix * DVector::from_column_slice(&right);
            lambda = dot(&left, image.as_slice()) / dot(&left, &right);
        }
        let mut left = null_vector(&matrix.transpose(), lambda);
        let right = null_vector(&matrix, lambda);
        let product = dot(&left, &right);
        left.iter_mut().for_each(|l| *l /= product);
        ComplexMode { lambda, right, left }
    };
    let real = mode(Complex64::from(eigenvalues[middle].re));
    let parts = |v: Vec<Complex64>| v.iter().map(|x| x.re).collect();
    let real =
        RealMode { lambda: real.lambda.re, right: parts(real.right), left: parts(real.left) };
    (real, eigenvalues[middle + 1..].iter().map(|&lambda| mode(lambda)).collect())
}

/// Returns the vector v with (M − λI) v = 0 whose last component is 1.
fn null_vector(matrix: &DMatrix<Complex64>, lambda: Complex64) -> Vec<Complex64> {
    let s = matrix.nrows();
    // The last equation is redundant and is replaced by v_s = 1.
    let mut system = matrix - DMatrix::from_diagonal_element(s, s, lambda);
    system.row_mut(s - 1).fill(Complex64::ZERO);
    system[(s - 1, s - 1)] = Complex64::ONE;
    let mut v = DVector::zeros(s);
    v[s - 1] = Complex64::ONE;
    let solved = system.lu().solve_mut(&mut v);
    assert!(solved, "no eigenvector of a Radau IIA matrix vanishes in its last component");
    v.iter().copied().collect()
}

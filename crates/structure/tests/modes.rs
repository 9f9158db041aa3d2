//! Tests of eigenpairs, compared with closed forms.

use std::f64::consts::PI;

use myovib_structure::{Constraint, Mode, StructureError, Vibration, modes, modes_below};
use nalgebra_sparse::{CooMatrix, CscMatrix};

/// Returns the tridiagonal matrix with constant diagonals, where `last` replaces the final diagonal entry.
fn tridiagonal(n: usize, diagonal: f64, off: f64, last: f64) -> CscMatrix<f64> {
    let mut matrix = CooMatrix::new(n, n);
    for i in 0..n {
        matrix.push(i, i, if i + 1 == n { last } else { diagonal });
        if i > 0 {
            matrix.push(i, i - 1, off);
            matrix.push(i - 1, i, off);
        }
    }
    CscMatrix::from(&matrix)
}

fn entries(rows: usize, columns: usize, entries: &[(usize, usize, f64)]) -> CscMatrix<f64> {
    let mut matrix = CooMatrix::new(rows, columns);
    for &(row, column, value) in entries {
        matrix.push(row, column, value);
    }
    CscMatrix::from(&matrix)
}

/// Asserts the relative agreement of a converged ω². The error is of second order in the residual, which is below
/// 1e-10. Therefore only the rounding of the factorization remains: ε times the condition number (1e4 here).
fn assert_close(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < 1e-11, "{found} against {expected}");
}

fn chain_omega_squared(j: usize, n: usize, k: f64, m: f64) -> f64 {
    let sine = (j as f64 * PI / (2 * (n + 1)) as f64).sin();
    4.0 * k / m * sine * sine
}

fn chain(n: usize, k: f64, m: f64, constraint: Option<Constraint>) -> Vibration {
    let mass = tridiagonal(n, m, 0.0, m);
    Vibration::new(mass, tridiagonal(n, 2.0 * k, -k, 2.0 * k), constraint).expect("sizes agree")
}

/// For n masses between two walls, ω_j = 2 √(k/m) sin(j π / (2 (n + 1))).
#[test]
fn chain_of_masses() {
    let (n, k, m) = (60, 1.1e4, 2e-3);
    let found = modes(&chain(n, k, m, None), 8, 0.0).unwrap();
    assert_eq!(found.len(), 8);
    for (j, mode) in found.iter().enumerate() {
        assert_close(mode.omega_squared, chain_omega_squared(j + 1, n, k, m));
        assert!(mode.residual < 1e-8 && mode.multipliers.is_empty());
    }
    for (i, left) in found.iter().enumerate() {
        for (j, right) in found.iter().enumerate() {
            let product: f64 = left.shape.iter().zip(&right.shape).map(|(u, v)| m * u * v).sum();
            assert!((product - f64::from(u8::from(i == j))).abs() < 1e-9);
        }
    }
}

/// Each limit is between two modes, and 0 to 19 modes are below it.
#[test]
fn all_modes_below_a_limit_and_the_next_are_found() {
    let (n, k, m) = (60, 1.1e4, 2e-3);
    let exact = |j| chain_omega_squared(j, n, k, m);
    let body = chain(n, k, m, None);
    for n_below in [0, 1, 2, 5, 19] {
        for part in [0.1, 0.5, 0.9] {
            let limit = (1.0 - part) * exact(n_below) + part * exact(n_below + 1);
            let found = modes_below(&body, limit, 20).unwrap().expect("at most 20 modes");
            assert_eq!(found.len(), n_below + 1);
            for (j, mode) in (1..).zip(&found) {
                assert_close(mode.omega_squared, exact(j));
            }
            assert!(modes_below(&body, limit, n_below).unwrap().is_none());
        }
    }
}

/// Grounded springs with negative stiffness lower all ω² by the same value, so the chain is unstable.
///
/// Regression: the eigenvectors of indefinite projected problems were wrong, and the modes nearest to 0 were
/// returned instead of the lowest modes.
#[test]
fn the_lowest_modes_of_an_unstable_chain() {
    let (n, k, m) = (60, 1.1e4, 2e-3);
    let exact = |j| chain_omega_squared(j, n, k, m);
    for n_unstable in [1, 2, 3, 7] {
        let lowered = 0.9 * exact(n_unstable + 1) + 0.1 * exact(n_unstable);
        let stiffness = 2.0 * k - m * lowered;
        let stiffness = tridiagonal(n, stiffness, -k, stiffness);
        let body = Vibration::new(tridiagonal(n, m, 0.0, m), stiffness, None).unwrap();
        for count in [1, 2, 3, 5, 10, 20] {
            let found = modes(&body, count, 0.0).unwrap();
            assert_eq!(found.len(), count);
            for (j, mode) in (1..).zip(&found) {
                // Rounding errors are relative to the eigenvalues of the chain without the negative springs.
                let error = (mode.omega_squared - (exact(j) - lowered)).abs();
                assert!(
                    error < 1e-11 * (exact(j) + lowered),
                    "{n_unstable} {count} {j}: {error:e}"
                );
                assert!(mode.residual < 1e-7, "{n_unstable} {count} {j}: {:e}", mode.residual);
                let sine = |i: usize| ((i + 1) as f64 * j as f64 * PI / (n + 1) as f64).sin();
                let product: f64 = (0..n).map(|i| sine(i) * mode.shape[i]).sum();
                let size = (m * (0..n).map(|i| sine(i).powi(2)).sum::<f64>()).sqrt();
                // The angle is at most the residual of θ (1e-10) divided by the relative gap (at least 0.01).
                assert!((product.abs() * m / size - 1.0).abs() < 1e-8);
            }
        }
    }
}

/// If all modes of a small chain are requested, the Krylov space is exhausted.
#[test]
fn a_small_chain_has_no_additional_modes() {
    let found = modes(&chain(3, 1.0, 1.0, None), 10, 0.0).unwrap();
    assert_eq!(found.len(), 3);
    for (j, mode) in found.iter().enumerate() {
        assert_close(mode.omega_squared, chain_omega_squared(j + 1, 3, 1.0, 1.0));
    }
}

/// For a clamped–free rod with linear elements, a consistent mass matrix, h = L/N and θ = (2j-1) π/(2N), the
/// discrete values are ω² = 6 EA/(ρ h²) (1 - cos θ)/(2 + cos θ). They converge to ω = (2j-1) π/(2L) √(EA/ρ) with
/// an error of O(h²).
#[test]
fn rod() {
    let (ea, rho, length) = (1e6, 1e3, 0.1);
    let lowest = |n: usize| {
        let h = length / n as f64;
        let mass = tridiagonal(n, 4.0 * rho * h / 6.0, rho * h / 6.0, 2.0 * rho * h / 6.0);
        let stiffness = tridiagonal(n, 2.0 * ea / h, -ea / h, ea / h);
        let found = modes(&Vibration::new(mass, stiffness, None).unwrap(), 3, 0.0).unwrap();
        for (j, mode) in found.iter().enumerate() {
            let cosine = ((2 * j + 1) as f64 * PI / (2 * n) as f64).cos();
            let discrete = 6.0 * ea / (rho * h * h) * (1.0 - cosine) / (2.0 + cosine);
            assert_close(mode.omega_squared, discrete);
        }
        found[0].angular_frequency().unwrap()
    };
    let exact = PI / (2.0 * length) * (ea / rho).sqrt();
    let (coarse, fine) = (lowest(10) / exact - 1.0, lowest(20) / exact - 1.0);
    // The relative error is (π/2N)²/24. The next term is below 1 % of this value.
    assert!((coarse / fine - 4.0).abs() < 0.04);
    assert!((coarse / ((PI / 20.0).powi(2) / 24.0) - 1.0).abs() < 0.01);
}

/// The eigenvalues of a square grid are sums of two eigenvalues of the chain, so every unequal pair occurs twice.
#[test]
fn double_eigenvalues_have_two_modes() {
    let m = 12;
    let line = tridiagonal(m, 2.0, -1.0, 2.0);
    let mut stiffness = CooMatrix::new(m * m, m * m);
    for (row, column, value) in line.triplet_iter() {
        for k in 0..m {
            stiffness.push(row * m + k, column * m + k, *value);
            stiffness.push(k * m + row, k * m + column, *value);
        }
    }
    let mass = tridiagonal(m * m, 1.0, 0.0, 1.0);
    let grid = Vibration::new(mass, CscMatrix::from(&stiffness), None).unwrap();
    let found = modes(&grid, 9, 0.0).unwrap();
    let one = |j| chain_omega_squared(j, m, 1.0, 1.0);
    let mut expected: Vec<f64> =
        (1..=m).flat_map(|i| (1..=m).map(move |j| one(i) + one(j))).collect();
    expected.sort_by(f64::total_cmp);
    for (mode, expected) in found.iter().zip(expected) {
        assert_close(mode.omega_squared, expected);
    }
}

fn omegas(modes: &[Mode]) -> Vec<f64> {
    modes.iter().map(|mode| mode.omega_squared).collect()
}

/// A multiplier that fixes one mass divides the chain into two shorter chains. The value of p is the reaction
/// force.
#[test]
fn a_rigid_constraint_divides_the_chain() {
    let (n, held, k, m) = (20, 7, 3.0, 0.5);
    let operator = entries(1, n, &[(0, held, 1.0)]);
    let constraint = Constraint { operator, compliance: CscMatrix::zeros(1, 1) };
    let found = modes(&chain(n, k, m, Some(constraint)), 6, 0.0).unwrap();
    let mut expected: Vec<f64> = (1..=held)
        .map(|j| chain_omega_squared(j, held, k, m))
        .chain((1..n - held).map(|j| chain_omega_squared(j, n - held - 1, k, m)))
        .collect();
    expected.sort_by(f64::total_cmp);
    for (mode, expected) in found.iter().zip(expected) {
        assert_close(mode.omega_squared, expected);
        let u = &mode.shape;
        assert!(u[held].abs() < 1e-12, "the mass moved by {:.1e}", u[held]);
        // At the fixed mass, u = 0, so K u − Bᵀp = ω² M u yields p = −k (left + right).
        let force = -k * (u[held - 1] + u[held + 1]);
        assert!((mode.multipliers[0] - force).abs() < 1e-8 * k);
    }
}

/// A compliant constraint is a spring: C p + u_h = 0 gives the force −u_h/C.
#[test]
fn a_compliant_constraint_is_a_spring() {
    let (n, held, spring) = (20, 7, 40.0);
    let operator = entries(1, n, &[(0, held, 1.0)]);
    let compliance = entries(1, 1, &[(0, 0, 1.0 / spring)]);
    let mixed = chain(n, 3.0, 0.5, Some(Constraint { operator, compliance }));
    let stiffness = tridiagonal(n, 6.0, -3.0, 6.0) + entries(n, n, &[(held, held, spring)]);
    let condensed = Vibration::new(tridiagonal(n, 0.5, 0.0, 0.5), stiffness, None).unwrap();
    let (mixed, condensed) = (modes(&mixed, 5, 0.0).unwrap(), modes(&condensed, 5, 0.0).unwrap());
    for (left, right) in omegas(&mixed).into_iter().zip(omegas(&condensed)) {
        assert_close(left, right);
    }
}

/// A free body has modes with ω = 0. The problem is singular with the shift 0, but a negative shift finds these
/// modes.
#[test]
fn a_free_body_needs_a_shift() {
    let stiffness = entries(2, 2, &[(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)]);
    let body = Vibration::new(tridiagonal(2, 1.0, 0.0, 1.0), stiffness, None).unwrap();
    assert!(matches!(modes(&body, 2, 0.0), Err(StructureError::Factorize(_))));
    let found = modes(&body, 2, -1.0).unwrap();
    assert!(found[0].omega_squared.abs() < 1e-14 && found[0].residual < 1e-14);
    assert_close(found[1].omega_squared, 2.0);
}

#[test]
fn matrices_of_different_sizes_are_rejected() {
    let error = Vibration::new(tridiagonal(3, 1.0, 0.0, 1.0), tridiagonal(2, 1.0, 0.0, 1.0), None);
    assert!(matches!(
        error,
        Err(StructureError::Sizes { matrix: "stiffness", got: (2, 2), expected: (3, 3) })
    ));
}

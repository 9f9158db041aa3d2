//! Factors in single precision: accuracy of refined solutions, equilibration, and switch to double precision.
#![allow(clippy::unwrap_used)] // a test may panic

use std::sync::Arc;

use myovib_sparse::{
    Elimination, Kind, LinearWork, Precision, Scalar, SparseError, SparseOptions, SparseSystem,
    Structure,
};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// Maximum backward error of refined solutions, as documented.
const REFINED: f64 = 1e-10;

/// Number of points per side of the grid.
const SIDE: usize = 12;

/// Returns the pattern of the five-point stencil on a square, by columns.
fn stencil() -> SparsityPattern {
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    let distance =
        |a: usize, b: usize| (a / SIDE).abs_diff(b / SIDE) + (a % SIDE).abs_diff(b % SIDE);
    for column in 0..SIDE * SIDE {
        rows.extend((0..SIDE * SIDE).filter(|&row| distance(column, row) <= 1));
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(SIDE * SIDE, SIDE * SIDE, offsets, rows).unwrap()
}

fn system<T: Scalar>(kind: Kind, precision: Precision) -> SparseSystem<T> {
    let structure = Structure { kind, ..Structure::default() };
    let options = SparseOptions { precision, ..SparseOptions::default() };
    let elimination = Elimination::new(&stencil(), structure, options).unwrap();
    SparseSystem::new(Arc::new(elimination))
}

/// Returns the entries of a diagonally dominant matrix. Each entry is multiplied by the `scale` of its row and of its
/// column.
fn entries<T: Scalar>(scale: impl Fn(usize) -> f64, mut draw: impl FnMut() -> T) -> Vec<T> {
    let pattern = stencil();
    let entries = pattern.entries();
    let mut values = Vec::new();
    for (column, row) in entries {
        let value = match row == column {
            true => T::one() * 5.0 + draw(),
            false => draw(),
        };
        values.push(value * (scale(row) * scale(column)));
    }
    values
}

/// Returns max_i |b − A x|_i / (|A||x| + |b|)_i.
fn backward_error<T: Scalar>(values: &[T], b: &[T], x: &[T]) -> f64 {
    let (mut residual, mut size) = (b.to_vec(), b.iter().map(|b| b.abs()).collect::<Vec<_>>());
    for ((column, row), &a) in stencil().entries().zip(values) {
        residual[row] -= a * x[column];
        size[row] += (a * x[column]).abs();
    }
    let ratios = residual.iter().zip(&size).map(|(r, size)| r.abs() / size);
    ratios.fold(0.0, f64::max)
}

/// Solves twice with one matrix whose rows have magnitudes from 1e-9 to 1e9. Returns the counters.
fn solve_twice<T: Scalar>(kind: Kind, mut draw: impl FnMut() -> T) -> LinearWork {
    let scale = |i: usize| 10_f64.powi(i as i32 % 19 - 9);
    let values = entries(scale, &mut draw);
    let mut system = system::<T>(kind, Precision::Mixed);
    let mut work = LinearWork::default();
    system.values_mut().copy_from_slice(&values);
    system.renew(&mut work).unwrap();
    let b: Vec<T> = (0..SIDE * SIDE).map(|i| draw() * scale(i)).collect();
    let mut x = b.clone();
    system.solve(&mut x, &mut work).unwrap();
    assert!(backward_error(&values, &b, &x) <= REFINED);
    let refined = x.clone();
    x.copy_from_slice(&b);
    system.solve(&mut x, &mut work).unwrap();
    // A well-conditioned matrix loses at most two of the seven digits of single precision.
    for (i, (x, refined)) in x.iter().zip(&refined).enumerate() {
        let largest = refined.abs().max(1.0 / scale(i));
        assert!((*x - *refined).abs() <= 1e2 * f64::from(f32::EPSILON) * largest);
    }
    work
}

#[test]
fn only_the_first_solution_is_refined() {
    let mut rng = StdRng::seed_from_u64(3);
    let real = solve_twice(Kind::General, || rng.random_range(-1.0..1.0));
    let complex = solve_twice(Kind::General, || {
        Complex64::new(rng.random_range(-0.7..0.7), rng.random_range(-0.7..0.7))
    });
    // One random number for all off-diagonal entries makes the matrix symmetric.
    let symmetric = solve_twice(Kind::Symmetric, || 0.7);
    for work in [real, complex, symmetric] {
        assert_eq!([work.factorizations, work.in_single_precision, work.solves], [1, 1, 2]);
        assert!((1..=2).contains(&work.refinements), "{work:?}");
    }
}

/// Returns a Laplacian with random weights and a small shift. Without boundary conditions, a Laplacian is singular, so
/// the shift results in a condition number of about 1e11.
fn ill_conditioned() -> Vec<f64> {
    let pattern = stencil();
    let weight = |a: usize, b: usize| 1.5 + ((a * b + a + b) as f64).sin();
    let value = |(column, row): (usize, usize)| {
        let others = pattern.lane(column).iter().filter(|&&other| other != column);
        match row == column {
            true => others.map(|&other| weight(column, other)).sum::<f64>() + 1e-10,
            false => -weight(row, column),
        }
    };
    pattern.entries().map(value).collect()
}

#[test]
fn ill_conditioned_matrices_are_factorized_in_double_precision() {
    let good = entries(|_| 1.0, || 0.5);
    let b: Vec<f64> = (0..SIDE * SIDE).map(|i| (i as f64).cos()).collect();
    let mut system = system::<f64>(Kind::Symmetric, Precision::Mixed);
    let mut work = LinearWork::default();
    let mut solve = |values: &[f64], system: &mut SparseSystem<f64>| {
        system.values_mut().copy_from_slice(values);
        system.renew(&mut work).unwrap();
        let mut x = b.clone();
        system.solve(&mut x, &mut work).unwrap();
        assert!(backward_error(values, &b, &x) <= REFINED);
        (x, work)
    };
    let (first, _) = solve(&good, &mut system);
    let start = system.history();
    let (_, work) = solve(&ill_conditioned(), &mut system);
    assert_eq!([work.factorizations, work.in_single_precision, work.pivoted], [3, 2, 0]);
    let (_, work) = solve(&good, &mut system);
    assert_eq!([work.factorizations, work.in_single_precision], [4, 2]);
    // With a restored history, the next factors are in single precision again, and the result is the same.
    system.set_history(start).unwrap();
    let (last, work) = solve(&good, &mut system);
    assert_eq!([work.factorizations, work.in_single_precision], [5, 3]);
    assert_eq!(first, last);
}

#[test]
fn only_large_matrices_are_mixed_automatically() {
    let mut system = system::<f64>(Kind::Symmetric, Precision::Auto);
    system.values_mut().copy_from_slice(&entries(|_| 1.0, || 0.5));
    let mut work = LinearWork::default();
    system.renew(&mut work).unwrap();
    assert_eq!(work.in_single_precision, 0);
}

#[test]
fn matrices_that_are_not_finite_are_rejected() {
    let mut system = system::<f64>(Kind::General, Precision::Mixed);
    let mut values = entries(|_| 1.0, || 0.5);
    values[7] = f64::NAN;
    system.values_mut().copy_from_slice(&values);
    let result = system.renew(&mut LinearWork::default());
    assert!(matches!(result, Err(SparseError::NotFinite { .. })), "{result:?}");
}

/// Regression test: a rejected state whose matrix was not finite made all later factors double.
#[test]
fn a_matrix_that_is_not_finite_does_not_end_single_precision() {
    let mut system = system::<f64>(Kind::Symmetric, Precision::Mixed);
    let mut work = LinearWork::default();
    system.values_mut().copy_from_slice(&entries(|_| 1.0, || 0.5));
    system.renew(&mut work).unwrap();
    let history = system.history();
    system.values_mut()[7] = f64::NAN;
    assert!(system.renew(&mut work).is_err());
    assert_eq!(system.history()[2], history[2]);
    system.values_mut()[7] = 0.5;
    system.renew(&mut work).unwrap();
    assert_eq!(work.in_single_precision, 2);
}

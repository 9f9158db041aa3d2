//! The supernodal factors against the matrices they are made of.
#![allow(clippy::unwrap_used)] // a test may panic

use std::sync::Arc;

use myovib_sparse::klu::KluOptions;
use myovib_sparse::supernodal::{Analysis, Supernodal, ZeroPivot};
use myovib_sparse::{Elimination, LinearWork, Number, SparseSystem};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// A pattern from (column, row) pairs.
fn pattern(n: usize, holds: impl Fn(usize, usize) -> bool) -> SparsityPattern {
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for column in 0..n {
        rows.extend((0..n).filter(|&row| holds(column, row)));
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows).unwrap()
}

fn system(p: &SparsityPattern, options: KluOptions) -> SparseSystem<f64> {
    SparseSystem::new(Arc::new(Elimination::new(p, options).unwrap()))
}

/// The nine-point stencil on a square of `side` points: an unsymmetric, diagonally dominant matrix.
fn stencil(side: usize) -> SparsityPattern {
    let near = |a: usize, b: usize| a.abs_diff(b) <= 1;
    pattern(side * side, |c, r| {
        near(c / side, r / side) && near(c % side, r % side)
    })
}

fn largest_residual<T: Number>(p: &SparsityPattern, values: &[T], b: &[T], x: &[T]) -> f64 {
    let mut residual = b.to_vec();
    for ((column, row), &a) in p.entries().zip(values) {
        residual[row] -= a * x[column];
    }
    residual.iter().map(|r| r.abs()).fold(0.0, f64::max)
}

fn dominant<T: Number>(p: &SparsityPattern, mut draw: impl FnMut() -> T) -> Vec<T> {
    let diagonal = T::one() * 12.0;
    p.entries()
        .map(|(c, r)| draw() + if c == r { diagonal } else { T::zero() })
        .collect()
}

/// Rows of nine entries of size 1 beside a diagonal of 12: solutions of size 1, rounded a few
/// times for each of some hundred operations on the way through the fronts.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

#[test]
fn factors_solve_real_and_complex_systems_in_any_order() {
    let mut rng = StdRng::seed_from_u64(4);
    for side in [1, 2, 5, 17] {
        let p = stencil(side);
        let n = side * side;
        let natural: Vec<usize> = (0..n).collect();
        let mut shuffled = natural.clone();
        for k in (1..n).rev() {
            shuffled.swap(k, rng.random_range(0..=k));
        }
        for order in [natural, shuffled] {
            let analysis = Arc::new(Analysis::new(&p, &order, 1));
            let b: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();

            let values = dominant(&p, || rng.random_range(-1.0..1.0));
            let mut real = Supernodal::new(analysis.clone());
            real.factor(&values).unwrap();
            let mut x = b.clone();
            real.solve(&mut x);
            assert!(largest_residual(&p, &values, &b, &x) < ROUNDING);

            let mut draw =
                || Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
            let values = dominant(&p, &mut draw);
            let mut complex = Supernodal::new(analysis);
            complex.factor(&values).unwrap();
            let b: Vec<Complex64> = b.iter().map(|&b| Complex64::new(b, 1.0)).collect();
            let mut x = b.clone();
            complex.solve(&mut x);
            assert!(largest_residual(&p, &values, &b, &x) < ROUNDING);
        }
    }
}

/// [2 1; 1 ·]: the second unknown has no diagonal entry.
#[test]
fn an_unknown_without_a_diagonal_waits_for_a_neighbour() {
    let p = pattern(2, |c, r| c + r < 2);
    let values = [2.0, 1.0, 1.0];
    let mut factors = Supernodal::new(Arc::new(Analysis::new(&p, &[1, 0], 1)));
    factors.factor(&values).unwrap();
    let mut x = [3.0, 5.0];
    factors.solve(&mut x);
    assert_eq!(x, [5.0, -7.0]);
}

#[test]
fn a_zero_pivot_is_said_and_klu_takes_over() {
    // [0 1; 1 0] with the diagonal in the pattern: only an exchange helps.
    let p = pattern(2, |_, _| true);
    let values = [0.0, 1.0, 1.0, 0.0];
    let mut factors = Supernodal::new(Arc::new(Analysis::new(&p, &[0, 1], 1)));
    assert_eq!(factors.factor(&values), Err(ZeroPivot));

    let mut work = LinearWork::default();
    let mut system = system(&p, KluOptions::default());
    system.values_mut().copy_from_slice(&values);
    system.renew(&mut work).unwrap();
    let mut x = [3.0, 5.0];
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!((x, work.pivoted), ([5.0, 3.0], 1));
}

#[test]
fn a_poor_pivot_is_found_on_the_solution_and_exchanged() {
    // [ε' 1; 1 1] without exchange loses all digits of the first unknown for ε' far below ε.
    let p = pattern(2, |_, _| true);
    let mut work = LinearWork::default();
    let options = KluOptions {
        btf: false,
        pivot_tolerance: 1.0,
        ..KluOptions::default()
    };
    let mut system = system(&p, options);
    system.values_mut().copy_from_slice(&[1e-40, 1.0, 1.0, 1.0]);
    system.renew(&mut work).unwrap();
    let mut x = [1.0, 2.0];
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!(x, [1.0, 1.0]);
    assert!(work.largest_backward_error < 1e-12);
}

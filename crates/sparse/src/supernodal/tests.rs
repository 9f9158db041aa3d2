//! Checks of solutions with supernodal factors by their residuals.
use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::supernodal::{Analysis, Supernodal};
use crate::{
    Elimination, Kind, LinearWork, Scalar, SparseError, SparseOptions, SparseSystem, Structure,
};

/// Returns the pattern of the (column, row) pairs for which `holds` is true.
fn pattern(n: usize, holds: impl Fn(usize, usize) -> bool) -> SparsityPattern {
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for column in 0..n {
        rows.extend((0..n).filter(|&row| holds(column, row)));
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows).unwrap()
}

fn system(p: &SparsityPattern, options: SparseOptions) -> SparseSystem<f64> {
    let elimination = Elimination::new(p, Structure::default(), options).unwrap();
    SparseSystem::new(Arc::new(elimination))
}

fn in_order(p: &SparsityPattern, kind: Kind, order: &[usize]) -> Arc<Analysis> {
    Arc::new(Analysis::with_order(p, kind, order).unwrap())
}

/// Returns the pattern of the nine-point stencil on a square with `side` points per side.
fn stencil(side: usize) -> SparsityPattern {
    let near = |a: usize, b: usize| a.abs_diff(b) <= 1;
    pattern(side * side, |c, r| near(c / side, r / side) && near(c % side, r % side))
}

fn largest_residual<T: Scalar>(p: &SparsityPattern, values: &[T], b: &[T], x: &[T]) -> f64 {
    largest(p.entries(), values, b, x)
}

fn largest_residual_transposed<T: Scalar>(
    p: &SparsityPattern,
    values: &[T],
    b: &[T],
    x: &[T],
) -> f64 {
    largest(p.entries().map(|(c, r)| (r, c)), values, b, x)
}

fn largest<T: Scalar>(
    entries: impl Iterator<Item = (usize, usize)>,
    values: &[T],
    b: &[T],
    x: &[T],
) -> f64 {
    let mut residual = b.to_vec();
    for ((column, row), &a) in entries.zip(values) {
        residual[row] -= a * x[column];
    }
    residual.iter().map(|r| r.abs()).fold(0.0, f64::max)
}

fn dominant<T: Scalar>(p: &SparsityPattern, mut draw: impl FnMut() -> T) -> Vec<T> {
    let diagonal = T::one() * 12.0;
    p.entries().map(|(c, r)| draw() + if c == r { diagonal } else { T::zero() }).collect()
}

/// Bound on the rounding error. Rows have nine entries of magnitude 1 and a diagonal of 12. Solutions have magnitude 1,
/// and each of about a hundred operations adds a few rounding errors.
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
            let analysis = in_order(&p, Kind::General, &order);
            let b: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();

            let values = dominant(&p, || rng.random_range(-1.0..1.0));
            let mut real = Supernodal::new(analysis.clone());
            real.factor(&values).unwrap();
            let mut x = b.clone();
            real.solve(&mut x);
            assert!(largest_residual(&p, &values, &b, &x) < ROUNDING);
            x.copy_from_slice(&b);
            real.solve_transposed(&mut x);
            assert!(largest_residual_transposed(&p, &values, &b, &x) < ROUNDING);

            let mut draw =
                || Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
            let values = dominant(&p, &mut draw);
            let mut complex = Supernodal::new(analysis);
            complex.factor(&values).unwrap();
            let b: Vec<Complex64> = b.iter().map(|&b| Complex64::new(b, 1.0)).collect();
            let mut x = b.clone();
            complex.solve(&mut x);
            assert!(largest_residual(&p, &values, &b, &x) < ROUNDING);
            x.copy_from_slice(&b);
            complex.solve_transposed(&mut x);
            assert!(largest_residual_transposed(&p, &values, &b, &x) < ROUNDING);
        }
    }
}

/// [2 1; 1 ·]: the second unknown has no diagonal entry.
#[test]
fn an_unknown_without_a_diagonal_is_eliminated_after_a_neighbor() {
    let p = pattern(2, |c, r| c + r < 2);
    let values = [2.0, 1.0, 1.0];
    let mut factors = Supernodal::new(Arc::new(Analysis::new(&p, Kind::General, 0..0).unwrap()));
    factors.factor(&values).unwrap();
    let mut x = [3.0, 5.0];
    factors.solve(&mut x);
    assert_eq!(x, [5.0, -7.0]);
}

#[test]
fn a_zero_pivot_is_an_error_and_leads_to_pivoting() {
    // [0 1; 1 0] with the diagonal in the pattern requires pivoting.
    let p = pattern(2, |_, _| true);
    let values = [0.0, 1.0, 1.0, 0.0];
    let mut factors = Supernodal::new(in_order(&p, Kind::General, &[0, 1]));
    assert_eq!(factors.factor(&values), Err(SparseError::ZeroPivot));

    let mut work = LinearWork::default();
    let mut system = system(&p, SparseOptions::default());
    system.values_mut().copy_from_slice(&values);
    system.renew(&mut work).unwrap();
    let mut x = [3.0, 5.0];
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!((x, work.pivoted), ([5.0, 3.0], 1));
}

#[test]
fn a_poor_pivot_is_detected_by_the_solution_and_leads_to_pivoting() {
    // [ε' 1; 1 1]: without pivoting, all digits of the first unknown are lost if ε' is far below ε.
    let p = pattern(2, |_, _| true);
    let mut work = LinearWork::default();
    let options = SparseOptions { btf: false, pivot_tolerance: 1.0, ..SparseOptions::default() };
    let mut system = system(&p, options);
    system.values_mut().copy_from_slice(&[1e-40, 1.0, 1.0, 1.0]);
    system.renew(&mut work).unwrap();
    let mut x = [1.0, 2.0];
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!(x, [1.0, 1.0]);
    assert!(work.largest_backward_error < 1e-12);
}

/// A saddle-point matrix similar to the matrix of a body: [K + c² M, −Bᵀ; −B, −δ I]. Each point of a grid of `side`³
/// points has three displacements, and every other point also has a pressure, which is coupled to the neighboring
/// points.
struct Saddle {
    pattern: SparsityPattern,
    values: Vec<f64>,
    pressures: std::ops::Range<usize>,
}

fn saddle(side: usize, delta: Option<f64>, rng: &mut StdRng) -> Saddle {
    let n_points = side.pow(3);
    let at = |k: usize| [k % side, k / side % side, k / side / side];
    let with_pressure = |k: &usize| at(*k).iter().all(|i| i % 2 == 0);
    let owners: Vec<usize> =
        (0..3 * n_points).map(|k| k / 3).chain((0..n_points).filter(with_pressure)).collect();
    let n_q = 3 * n_points;
    let near = |a: usize, b: usize| {
        let (a, b) = (at(owners[a]), at(owners[b]));
        (0..3).all(|i| a[i].abs_diff(b[i]) <= 1)
    };
    let pattern = pattern(owners.len(), |c, r| match (c >= n_q, r >= n_q) {
        (true, true) => c == r && delta.is_some(),
        _ => near(c, r),
    });
    let mut drawn = std::collections::HashMap::new();
    let values = pattern.entries().map(|(c, r)| match (c == r, c >= n_q) {
        (true, true) => -delta.unwrap(),
        // A row has 27 points with three components each, so the diagonal dominates the rows of K.
        (true, false) => 100.0,
        _ => *drawn.entry((c.min(r), c.max(r))).or_insert_with(|| rng.random_range(-1.0..1.0)),
    });
    Saddle { values: values.collect(), pressures: n_q..owners.len(), pattern }
}

impl Saddle {
    fn structure(&self) -> Structure {
        Structure { kind: Kind::Symmetric, constraints: self.pressures.clone() }
    }

    fn elimination(&self, structure: Structure) -> Elimination {
        Elimination::new(&self.pattern, structure, SparseOptions::default()).unwrap()
    }
}

/// Solves A x = b with fixed pivots only. Returns the solution and its backward error.
fn solve<T: Scalar>(elimination: Elimination, values: &[T], b: &[T]) -> (Vec<T>, f64) {
    let mut work = LinearWork::default();
    let mut system = SparseSystem::new(Arc::new(elimination));
    system.values_mut().copy_from_slice(values);
    system.renew(&mut work).unwrap();
    let mut x = b.to_vec();
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!((work.pivoted, work.refinements), (0, 0));
    expect_columns_match(&mut system, b);
    (x, work.largest_backward_error)
}

/// Compares a solve for 15 right-hand sides, in blocks of 8 + 4 + 2 + 1, with separate solves.
fn expect_columns_match<T: Scalar>(system: &mut SparseSystem<T>, b: &[T]) {
    let (n, n_columns) = (b.len(), 15);
    let mut work = LinearWork::default();
    let of = |row: usize, column: usize| b[(row * (column + 1)) % n];
    let mut all: Vec<T> = (0..n * n_columns).map(|k| of(k / n_columns, k % n_columns)).collect();
    system.solve_columns(&mut all, n_columns, &mut work).unwrap();
    assert_eq!(work.solves, n_columns as u64);
    for column in 0..n_columns {
        let mut x: Vec<T> = (0..n).map(|row| of(row, column)).collect();
        system.solve(&mut x, &mut work).unwrap();
        let size = x.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
        for (row, x) in x.iter().enumerate() {
            // The operations are identical except for the evaluation of complex products.
            let differ = (*x - all[row * n_columns + column]).abs();
            assert!(differ < 1e-12 * size, "{column}: {differ:e}");
        }
    }
}

/// Maximum componentwise backward error of the solutions below. Each of about a hundred operations adds a few rounding
/// errors.
const BACKWARD: f64 = 1e-13;

#[test]
fn ldlt_and_lu_agree_for_symmetric_matrices() {
    let mut rng = StdRng::seed_from_u64(18);
    // The fronts of the last size are processed in blocks.
    for side in [2, 3, 8] {
        for delta in [None, Some(1e-5)] {
            let saddle = saddle(side, delta, &mut rng);
            let n = saddle.pattern.major_dim();
            let b: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
            let general = Structure { kind: Kind::General, ..saddle.structure() };
            let half = saddle.elimination(saddle.structure());
            let all = saddle.elimination(general.clone());
            let work = |e: &Elimination| e.prediction::<f64>().unwrap().flops;
            assert!(work(&half) < 0.6 * work(&all), "{side}");
            let (x, error) = solve(half, &saddle.values, &b);
            let (y, other) = solve(all, &saddle.values, &b);
            assert!(error.max(other) < BACKWARD, "{side}: {error:e} {other:e}");
            // Pivots and their order are identical, so the solutions are equal except for rounding.
            let largest = y.iter().fold(0.0, |max: f64, y| max.max(y.abs()));
            let differ = x.iter().zip(&y).map(|(x, y)| (x - y).abs());
            assert!(differ.fold(0.0, f64::max) < 1e-9 * largest);

            let turned = Complex64::new(1.0, 0.7);
            let values: Vec<_> = saddle.values.iter().map(|&a| turned * a).collect();
            let b: Vec<_> = b.iter().map(|&b| Complex64::new(b, 1.0)).collect();
            let half = saddle.elimination(saddle.structure());
            for elimination in [half, saddle.elimination(general)] {
                let (_, error) = solve(elimination, &values, &b);
                assert!(error < BACKWARD, "{side}: {error:e}");
            }
        }
    }
}

/// A special kernel is used for fronts of two columns and one real right-hand side. The general kernels are used for
/// several right-hand sides and for complex ones.
#[test]
fn narrow_fronts_agree_with_the_general_kernels() {
    let mut rng = StdRng::seed_from_u64(21);
    // The grid has 6 × 6 points with two unknowns each.
    let points = stencil(6);
    let is_entry = |a: usize, b: usize| points.lane(a / 2).contains(&(b / 2));
    let p = pattern(2 * points.major_dim(), is_entry);
    let n = p.major_dim();
    let mut drawn = vec![0.0; n * n];
    for (c, r) in (0..n).flat_map(|c| (0..=c).map(move |r| (c, r))) {
        let value = rng.random_range(-1.0..1.0) + if c == r { 24.0 } else { 0.0 };
        (drawn[c * n + r], drawn[r * n + c]) = (value, value);
    }
    let values: Vec<f64> = p.entries().map(|(c, r)| drawn[c * n + r]).collect();
    let b: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    for kind in [Kind::Symmetric, Kind::General] {
        // The unknowns are eliminated in the order of the points, independent of the orderings available in this build.
        let analysis = in_order(&p, kind, &(0..n).collect::<Vec<_>>());
        let is_pair = |&(columns, rows): &(usize, usize)| columns == 2 && rows > 8;
        assert!(analysis.supernodes().filter(is_pair).count() > 1);
        let mut factors = Supernodal::new(analysis);
        factors.factor(&values).unwrap();
        let mut alone = b.clone();
        factors.solve(&mut alone);
        assert!(largest_residual(&p, &values, &b, &alone) < ROUNDING, "{kind:?}");
        let mut beside: Vec<f64> = b.iter().flat_map(|&b| [b, 1.0]).collect();
        factors.solve_columns(&mut beside, 2);
        for (alone, beside) in alone.iter().zip(beside.chunks_exact(2)) {
            assert!((alone - beside[0]).abs() < ROUNDING, "{kind:?}");
        }
    }
}

#[test]
fn results_are_bitwise_independent_of_the_number_of_threads() {
    let mut rng = StdRng::seed_from_u64(2);
    // The largest front has 1247 rows, so it is split into several parts of each type.
    let saddle = saddle(14, None, &mut rng);
    let b: Vec<f64> = saddle.pattern.major_offsets()[1..].iter().map(|&k| k as f64).collect();
    for kind in [Kind::Symmetric, Kind::General] {
        let structure = || Structure { kind, ..saddle.structure() };
        let with = |threads: usize| {
            let elimination = saddle.elimination(structure());
            let (x, error) = solve(elimination.in_threads(threads).unwrap(), &saddle.values, &b);
            assert!(error < BACKWARD, "{kind:?}, {threads} threads: {error:e}");
            x.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        };
        let alone = with(1);
        for threads in [2, 3] {
            assert_eq!(with(threads), alone, "{threads} threads");
        }
    }
}

/// Regression test: pressures with a diagonal entry, however small, were eliminated first. The matrix is
/// quasi-definite, so pivots exist for any order, but with δ = 1e-12, pressures lose all digits if they are eliminated
/// first.
#[test]
fn pressures_of_a_nearly_incompressible_body_are_eliminated_after_displacements() {
    let mut rng = StdRng::seed_from_u64(12);
    let saddle = saddle(5, Some(1e-12), &mut rng);
    let n = saddle.pattern.major_dim();
    let b = vec![1.0; n];
    let (_, error) = solve(saddle.elimination(saddle.structure()), &saddle.values, &b);
    assert!(error < BACKWARD, "{error:e}");

    let pressures_first: Vec<usize> =
        saddle.pressures.clone().chain(0..saddle.pressures.start).collect();
    let pressures_last: Vec<usize> = (0..n).collect();
    let residual = |order: &[usize]| {
        let mut factors = Supernodal::new(in_order(&saddle.pattern, Kind::Symmetric, order));
        factors.factor(&saddle.values).unwrap();
        let mut x = b.clone();
        factors.solve(&mut x);
        largest_residual(&saddle.pattern, &saddle.values, &b, &x)
    };
    let (last, first) = (residual(&pressures_last), residual(&pressures_first));
    assert!(last < 1e3 * f64::EPSILON * 100.0, "{last:e}");
    assert!(first > 1e-8, "{first:e}");
}

/// Regression test: a zero right-hand side counted as checked, and the next solution was not checked.
#[test]
fn a_zero_right_hand_side_defers_the_check() {
    let p = pattern(2, |_, _| true);
    let mut work = LinearWork::default();
    let mut system = system(&p, SparseOptions::default());
    system.values_mut().copy_from_slice(&[1e-40, 1.0, 1.0, 1.0]);
    system.renew(&mut work).unwrap();
    let mut x = [0.0; 2];
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!(x, [0.0; 2]);
    let mut x = [1.0, 2.0];
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!(x, [1.0, 1.0]);
}

/// Regression test: a solution without correct digits was returned if pivoting did not help.
#[test]
fn an_inaccurate_solution_is_an_error() {
    // Overflow: x = (1e200, 1e200) up to rounding for b = 1, but x cannot be represented for b = 1e300.
    let p = pattern(2, |_, _| true);
    let mut work = LinearWork::default();
    let mut system = system(&p, SparseOptions::default());
    system.values_mut().copy_from_slice(&[1e-200, 0.0, 0.0, 1e-200]);
    system.renew(&mut work).unwrap();
    let refused = system.solve(&mut [1e300, 1.0], &mut work);
    assert!(matches!(refused, Err(SparseError::Inaccurate { n: 2, .. })), "{refused:?}");
    // Rejected solutions do not affect this number. The checkpoint stores it and must remain readable.
    assert_eq!(work.largest_backward_error, 0.0);
    let refused = system.solve(&mut [f64::NAN, 1.0], &mut work);
    assert!(matches!(refused, Err(SparseError::NotFinite { position: 0, .. })), "{refused:?}");
}

#[test]
fn an_unknown_in_no_equation_is_an_error_with_its_index() {
    let p = pattern(3, |c, r| c != 1 && r != 1);
    let refused = Elimination::new(&p, Structure::default(), SparseOptions::default());
    assert_eq!(refused.unwrap_err(), SparseError::EmptyColumn { column: 1 });
}

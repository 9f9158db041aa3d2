//! Tests of KLU through the safe interface: residuals of solutions, and errors.
#![cfg(klu)]
#![allow(clippy::unwrap_used)] // a test may panic

use myovib_sparse::klu::{Factors, Pivots, Symbolic};
use myovib_sparse::{Factorization, Ordering, Scalar, Scaling, SparseError, SparseOptions};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

/// Maximum relative residual. The residual of a backward stable solve is a small multiple of the rounding unit times
/// the pivot growth, which is at most 1e3 for a pivot tolerance of 1e-3.
const RESIDUAL: f64 = 1e3 * f64::EPSILON;

/// A reproducible sequence of numbers in [-1, 1).
struct Stream(u64);

impl Stream {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Returns a pattern with a full diagonal and about `per_column` other entries in each column.
fn pattern(n: usize, per_column: usize) -> SparsityPattern {
    let mut stream = Stream(7);
    let (mut offsets, mut indices) = (vec![0], Vec::new());
    for column in 0..n {
        let mut rows = vec![column];
        for _ in 0..per_column {
            rows.push((((stream.next() + 1.0) / 2.0) * n as f64) as usize % n);
        }
        rows.sort_unstable();
        rows.dedup();
        indices.extend(rows);
        offsets.push(indices.len());
    }
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, indices).unwrap()
}

fn real_values(pattern: &SparsityPattern, seed: u64) -> Vec<f64> {
    let mut stream = Stream(seed);
    pattern.entries().map(|(c, r)| stream.next() + if r == c { 3.0 } else { 0.0 }).collect()
}

/// Factorizes the matrix with the given values.
fn factorized<T: Scalar>(symbolic: &Symbolic, values: &[T]) -> Result<Factors<T>, SparseError> {
    let mut factors = Factors::new(symbolic.clone());
    factors.renew(values)?;
    Ok(factors)
}

/// Computes A x or Aᵀ x.
fn product<T: Scalar + std::ops::Mul<Output = T> + std::ops::AddAssign + Default>(
    pattern: &SparsityPattern,
    values: &[T],
    x: &[T],
    transposed: bool,
) -> Vec<T> {
    let mut y = vec![T::default(); x.len()];
    for ((column, row), &a) in pattern.entries().zip(values) {
        if transposed {
            y[column] += a * x[row];
        } else {
            y[row] += a * x[column];
        }
    }
    y
}

#[test]
fn solves_with_every_ordering_with_and_without_blocks_and_scaling() {
    let pattern = pattern(60, 3);
    let values = real_values(&pattern, 3);
    let b: Vec<f64> = (0..60).map(|i| 1.0 + i as f64).collect();
    for ordering in [Ordering::Amd, Ordering::Colamd, Ordering::Natural] {
        for btf in [true, false] {
            for scaling in [Scaling::None, Scaling::Sum, Scaling::Max] {
                let options = SparseOptions { ordering, btf, scaling, ..SparseOptions::default() };
                let symbolic = Symbolic::analyze(&pattern, options).unwrap();
                let lu = factorized(&symbolic, &values).unwrap();
                for transposed in [false, true] {
                    let mut x = b.clone();
                    if transposed { lu.solve_transposed(&mut x) } else { lu.solve(&mut x) }
                        .unwrap();
                    for (ax, b) in product(&pattern, &values, &x, transposed).iter().zip(&b) {
                        assert!((ax - b).abs() <= RESIDUAL * 60.0, "{options:?}: {ax} ≠ {b}");
                    }
                }
            }
        }
    }
}

#[test]
fn complex_factors_share_the_analysis_and_solve_real_and_transposed_systems() {
    let pattern = pattern(40, 3);
    let symbolic = Symbolic::analyze(&pattern, SparseOptions::default()).unwrap();
    let (re, im) = (real_values(&pattern, 3), real_values(&pattern, 9));
    let values: Vec<_> = re.iter().zip(&im).map(|(&re, &im)| Complex64::new(re, im)).collect();
    let real = factorized(&symbolic, &re).unwrap();
    let complex = factorized(&symbolic, &values).unwrap();
    drop(symbolic); // the factors keep the analysis alive

    let b: Vec<_> = (0..40).map(|i| Complex64::new(1.0, i as f64)).collect();
    for transposed in [false, true] {
        let mut x = b.clone();
        if transposed { complex.solve_transposed(&mut x) } else { complex.solve(&mut x) }.unwrap();
        for (ax, b) in product(&pattern, &values, &x, transposed).iter().zip(&b) {
            assert!((ax - b).norm() <= RESIDUAL * 40.0, "{ax} ≠ {b}");
        }
    }
    let mut x = vec![1.0; 40];
    real.solve(&mut x).unwrap();
    for ax in product(&pattern, &re, &x, false) {
        assert!((ax - 1.0).abs() <= RESIDUAL, "{ax}");
    }
}

#[test]
fn a_refactorization_solves_the_new_system_and_several_right_hand_sides_at_once() {
    let pattern = pattern(30, 2);
    let symbolic = Symbolic::analyze(&pattern, SparseOptions::default()).unwrap();
    let mut lu = factorized(&symbolic, &real_values(&pattern, 3)).unwrap();
    let values = real_values(&pattern, 4);
    assert_eq!(lu.renew(&values).unwrap(), Pivots::Reused);
    let b: Vec<f64> = (0..90).map(|i| (i as f64).cos()).collect();
    let mut x = b.clone();
    lu.solve(&mut x).unwrap();
    for (x, b) in x.chunks(30).zip(b.chunks(30)) {
        for (ax, b) in product(&pattern, &values, x, false).iter().zip(b) {
            assert!((ax - b).abs() <= RESIDUAL, "{ax} ≠ {b}");
        }
    }
}

/// diag(1, 10, 100) has no pivot growth and requires no elimination.
#[test]
fn diagnostics_of_a_diagonal_matrix() {
    let pattern =
        SparsityPattern::try_from_offsets_and_indices(3, 3, vec![0, 1, 2, 3], vec![0, 1, 2])
            .unwrap();
    let options = SparseOptions { scaling: Scaling::None, btf: false, ..SparseOptions::default() };
    let symbolic = Symbolic::analyze(&pattern, options).unwrap();
    let values = [1.0, 10.0, 100.0];
    let mut factors = Factors::<f64>::new(symbolic);
    assert_eq!((factors.rcond(), factors.n_entries()), (None, None));
    factors.renew(&values).unwrap();
    assert_eq!((factors.rcond(), factors.n_entries()), (Some(0.01), Some(6)));
}

#[test]
fn amd_avoids_the_fill_of_an_arrow_matrix() {
    // The first row, the first column and the diagonal are full: eliminating the first variable fills the matrix.
    let n = 20;
    let (mut offsets, mut indices) = (vec![0], (0..n).collect::<Vec<_>>());
    offsets.push(n);
    for column in 1..n {
        indices.extend([0, column]);
        offsets.push(indices.len());
    }
    let pattern = SparsityPattern::try_from_offsets_and_indices(n, n, offsets, indices).unwrap();
    let values: Vec<f64> =
        pattern.entries().map(|(c, r)| if r == c { n as f64 } else { 1.0 }).collect();
    let entries = |ordering| {
        let options = SparseOptions { ordering, btf: false, ..SparseOptions::default() };
        let symbolic = Symbolic::analyze(&pattern, options).unwrap();
        factorized(&symbolic, &values).unwrap().n_entries()
    };
    assert_eq!(entries(Ordering::Natural), Some(n * (n + 1)));
    assert_eq!(entries(Ordering::Amd), Some(2 * (2 * n - 1)));
}

#[test]
fn singular_matrices_are_errors_with_the_column() {
    // Row 1 is empty, so the matrix is structurally singular.
    let empty_row =
        SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 1, 2], vec![0, 0]).unwrap();
    let symbolic = Symbolic::analyze(&empty_row, SparseOptions::default()).unwrap();
    let error = factorized(&symbolic, &[1.0, 1.0]).unwrap_err();
    let SparseError::Singular { n: 2, column } = error else { panic!("{error}") };
    assert!(column.is_none_or(|column| column < 2), "{column:?}");

    // [1 1; 1 1] is numerically singular.
    let full = SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1])
        .unwrap();
    let symbolic = Symbolic::analyze(&full, SparseOptions::default()).unwrap();
    let error = factorized(&symbolic, &[1.0; 4]).unwrap_err();
    assert_eq!(error, SparseError::Singular { n: 2, column: Some(1) });
}

#[test]
fn invalid_arguments_are_errors() {
    let wide =
        SparsityPattern::try_from_offsets_and_indices(2, 3, vec![0, 1, 2], vec![0, 1]).unwrap();
    let analyze = |pattern: &SparsityPattern| Symbolic::analyze(pattern, SparseOptions::default());
    assert_eq!(analyze(&wide).unwrap_err(), SparseError::NotSquare { rows: 3, columns: 2 });
    let empty = SparsityPattern::zeros(0, 0);
    assert_eq!(analyze(&empty).unwrap_err(), SparseError::NotSquare { rows: 0, columns: 0 });

    let symbolic = analyze(&pattern(3, 0)).unwrap();
    let error = factorized(&symbolic, &[1.0]).unwrap_err();
    assert!(matches!(error, SparseError::WrongLength { expected: 3, got: 1, .. }), "{error}");
    let error = factorized(&symbolic, &[1.0, f64::NAN, 1.0]).unwrap_err();
    assert_eq!(error, SparseError::NotFinite { of: "matrix", position: 1 });
    let mut lu = factorized(&symbolic, &[1.0; 3]).unwrap();
    assert_eq!(
        lu.renew(&[1.0, 1.0, f64::INFINITY]),
        Err(SparseError::NotFinite { of: "matrix", position: 2 })
    );
    let error = lu.solve(&mut [1.0; 4]).unwrap_err();
    assert!(matches!(error, SparseError::WrongLength { expected: 3, got: 4, .. }), "{error}");
    assert_eq!(lu.solve(&mut [1.0; 3]), Err(SparseError::NoFactors));
}

#[test]
fn complex_values_must_be_finite_in_both_parts() {
    let symbolic = Symbolic::analyze(&pattern(2, 0), SparseOptions::default()).unwrap();
    for bad in [Complex64::new(0.0, f64::NAN), Complex64::new(f64::INFINITY, 0.0)] {
        let error = factorized(&symbolic, &[Complex64::ONE, bad]).unwrap_err();
        assert_eq!(error, SparseError::NotFinite { of: "matrix", position: 1 });
    }
}

/// With diagonal pivots, [p 1; 1 1] has the pivots p and 1 − 1/p, so the growth is 1/p − 1.
#[test]
fn pivots_are_kept_while_they_are_accurate() {
    let full = SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1])
        .unwrap();
    let symbolic = Symbolic::analyze(&full, SparseOptions::default()).unwrap();
    // The new pivots have a growth of 19. A growth of 19 000 is the limit (three digits less accurate): growths of 99
    // and 999 are accepted, and a growth of 1e9 is rejected.
    let mut factors = Factors::<f64>::new(symbolic);
    assert_eq!(factors.solve(&mut [1.0, 1.0]), Err(SparseError::NoFactors));
    for (p, pivots) in [
        (0.05, Pivots::Fresh),
        (0.01, Pivots::Reused),
        (1e-3, Pivots::Reused),
        (1e-9, Pivots::Fresh),
        (3.0, Pivots::Reused),
        (0.5, Pivots::Reused),
    ] {
        assert_eq!(factors.renew(&[p, 1.0, 1.0, 1.0]).unwrap(), pivots, "{p}");
        let mut x = [1.0 + p, 2.0];
        factors.solve(&mut x).unwrap();
        // The growth of kept pivots is at most 999; the condition number is about ten.
        let error = (x[0] - 1.0).abs().max((x[1] - 1.0).abs());
        assert!(error < 1e4 * f64::EPSILON, "{p}: {x:?}");
    }
    // After a failed factorization, the factors of the earlier matrix are not available, but its pivots are kept.
    assert!(matches!(factors.renew(&[1.0; 4]), Err(SparseError::Singular { .. })));
    assert_eq!(factors.solve(&mut [1.0, 1.0]), Err(SparseError::NoFactors));
    factors.renew(&[3.0, 1.0, 1.0, 1.0]).unwrap();
    assert!(matches!(
        factors.renew(&[f64::NAN; 4]),
        Err(SparseError::NotFinite { of: "matrix", position: 0 })
    ));
    assert_eq!(factors.solve(&mut [1.0, 1.0]), Err(SparseError::NoFactors));
    assert_eq!(factors.renew(&[3.0, 1.0, 1.0, 1.0]).unwrap(), Pivots::Reused);
}

#[test]
fn several_threads_share_one_analysis() {
    fn assert_send<T: Send>() {}
    fn assert_sync<T: Sync>() {}
    assert_send::<Factors<f64>>();
    assert_send::<Factors<Complex64>>();
    assert_send::<Symbolic>();
    assert_sync::<Symbolic>();

    let pattern = pattern(80, 3);
    // With COLAMD, factorizations write size estimates to the shared analysis.
    let options = SparseOptions { ordering: Ordering::Colamd, ..SparseOptions::default() };
    let symbolic = Symbolic::analyze(&pattern, options).unwrap();
    std::thread::scope(|scope| {
        for seed in 0..16 {
            let (symbolic, pattern) = (symbolic.clone(), &pattern);
            scope.spawn(move || {
                let values = real_values(pattern, seed);
                let lu = factorized(&symbolic, &values).unwrap();
                let mut x = vec![1.0; 80];
                lu.solve(&mut x).unwrap();
                for ax in product(pattern, &values, &x, false) {
                    assert!((ax - 1.0).abs() <= RESIDUAL, "{ax}");
                }
            });
        }
    });
}

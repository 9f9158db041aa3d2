//! Tests of inf–sup constants, compared with dense singular values and a closed form.

use std::f64::consts::PI;

use myovib_structure::{InfSup, Verdict};
use nalgebra::{DMatrix, SymmetricEigen};
use nalgebra_sparse::CscMatrix;

/// The difference operator of n + 1 displacements has n rows. The eigenvalues of B Bᵀ are 2 − 2 cos(j π/(n + 1)).
#[test]
fn the_difference_operator() {
    let n = 30;
    let b = DMatrix::from_fn(n, n + 1, |i, j| match j as i64 - i as i64 {
        0 => -1.0,
        1 => 1.0,
        _ => 0.0,
    });
    let found =
        InfSup::of(&CscMatrix::from(&b), &CscMatrix::identity(n + 1), &CscMatrix::identity(n))
            .unwrap();
    assert_eq!((found.nullity(), found.decision.verdict), (0, Verdict::Decisive));
    for (j, value) in found.constants.iter().enumerate() {
        let expected = 2.0 * ((j + 1) as f64 * PI / (2 * (n + 1)) as f64).sin();
        // The error of β² is at most ε times the shift, which is 1e-3 times a typical value of 2. The error of β
        // is therefore below 1e-16 / β.
        assert!((value - expected).abs() < 1e-12);
    }
}

/// The operator B = 0 does not control any pressure.
#[test]
fn a_zero_operator_controls_no_pressure() {
    for n in [0, 5] {
        let identity = CscMatrix::identity(n);
        let found = InfSup::of(&CscMatrix::zeros(n, 7), &CscMatrix::identity(7), &identity);
        let found = found.unwrap();
        assert_eq!((found.nullity(), found.smallest()), (n, None));
        assert_eq!(found.decision.verdict, Verdict::Decisive);
    }
}

/// Dependent rows are counted, and the other values agree with a dense generalized eigenproblem.
#[test]
fn dependent_rows_are_counted() {
    let (np, nu) = (12, 20);
    let mut b = DMatrix::from_fn(np, nu, |i, j| ((3 * i * i + 5 * j + i * j) as f64).sin());
    for row in 0..3 {
        let copy = b.row(row) * 2.0 - b.row(row + 4);
        b.row_mut(row + 8).copy_from(&copy);
    }
    let spd = |n: usize| {
        DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 4.0 + (i as f64).cos(),
            1 => -1.0,
            _ => 0.0,
        })
    };
    let (h, n) = (spd(nu), spd(np));
    let found =
        InfSup::of(&CscMatrix::from(&b), &CscMatrix::from(&h), &CscMatrix::from(&n)).unwrap();
    assert_eq!((found.nullity(), found.decision.verdict), (3, Verdict::Decisive));

    let factor = n.cholesky().unwrap().l().try_inverse().unwrap();
    let dense = &factor * &b * h.try_inverse().unwrap() * b.transpose() * factor.transpose();
    let mut expected: Vec<f64> = SymmetricEigen::new(dense)
        .eigenvalues
        .iter()
        .map(|square| square.max(0.0).sqrt())
        .collect();
    expected.sort_by(f64::total_cmp);
    for (value, expected) in found.constants.iter().zip(&expected[3..]) {
        assert!((value - expected).abs() < 1e-10, "{value} against {expected}");
    }
}

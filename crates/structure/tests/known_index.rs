//! Pencils whose index is known by construction, from the literature, or by differentiation.

use myovib_structure::{Index, Pencil, PencilStructure, Verdict};
use nalgebra::{DMatrix, DVector, dmatrix};
use rand::rngs::StdRng;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};

fn structure(e: DMatrix<f64>, a: DMatrix<f64>) -> PencilStructure {
    PencilStructure::of(&Pencil::new(e, a).expect("square and finite"))
}

/// Checks the index of the pencil (E, A) and the indices of its variables.
#[track_caller]
fn assert_indices(e: &DMatrix<f64>, a: &DMatrix<f64>, index: usize, variables: &[u8]) {
    let found = structure(e.clone(), a.clone());
    assert_eq!((found.index, &indices(&found)[..]), (Index::Decided(index), variables));
}

fn indices(structure: &PencilStructure) -> Vec<u8> {
    assert!(structure.variables.iter().all(|v| v.verdict == Verdict::Decisive), "{structure:#?}");
    structure.variables.iter().map(|v| v.index).collect()
}

/// Returns a Jordan block with eigenvalue zero, whose entries above the diagonal are one.
fn nilpotent(n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(j == i + 1)))
}

fn direct_sum(blocks: &[DMatrix<f64>]) -> DMatrix<f64> {
    let n = blocks.iter().map(DMatrix::nrows).sum();
    let mut sum = DMatrix::zeros(n, n);
    let mut at = 0;
    for block in blocks {
        sum.view_mut((at, at), block.shape()).copy_from(block);
        at += block.nrows();
    }
    sum
}

/// Returns a random matrix with singular values between 0.1 and 10.
fn well_conditioned(n: usize, rng: &mut StdRng) -> DMatrix<f64> {
    let mut orthogonal = || DMatrix::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0)).qr().q();
    let (left, right) = (orthogonal(), orthogonal());
    let spread = DVector::from_fn(n, |_, _| 10f64.powf(rng.random_range(-1.0..1.0)));
    left * DMatrix::from_diagonal(&spread) * right
}

/// Returns random units as a diagonal matrix with entries from 1e-6 to 1e6.
fn units(n: usize, rng: &mut StdRng) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_fn(n, |_, _| 10f64.powf(rng.random_range(-6.0..6.0))))
}

#[test]
fn an_ordinary_differential_equation_has_index_0() {
    let (e, a) = (dmatrix![2.0, 1.0; 0.0, 3.0], dmatrix![1.0, 0.0; 0.0, 0.0]);
    assert_indices(&e, &a, 0, &[0, 0]);
}

/// In N ẋ + x = f, x_1 contains the derivative of f_n of order n − 1, whereas x_n contains no derivative.
#[test]
fn a_chain_has_the_index_of_its_length() {
    for n in 1..=6 {
        let counting_down: Vec<u8> = (1..=n as u8).rev().collect();
        assert_indices(&nilpotent(n), &DMatrix::identity(n, n), n, &counting_down);
    }
}

/// Two masses are connected by a spring, and the position of the second mass is prescribed. The multiplier is the
/// force on the first mass. It contains the fourth derivative of this position, so the index is 5. With a prescribed
/// velocity, the index is 4.
#[test]
fn a_force_found_through_a_spring_has_index_4_and_5() {
    // The unknowns are q1, q2, v1, v2, λ.
    let mut e = DMatrix::identity(5, 5);
    e[(4, 4)] = 0.0;
    let mut a = dmatrix![
        0.0, 0.0, -1.0, 0.0, 0.0;
        0.0, 0.0, 0.0, -1.0, 0.0;
        1.0, -1.0, 0.0, 0.0, -1.0;
        -1.0, 1.0, 0.0, 0.0, 0.0;
        0.0, 1.0, 0.0, 0.0, 0.0
    ];
    assert_indices(&e, &a, 5, &[3, 1, 4, 2, 5]);
    (a[(4, 1)], a[(4, 3)]) = (0.0, 1.0);
    assert_indices(&e, &a, 4, &[2, 0, 3, 1, 4]);
}

/// In constrained mechanics, positions, velocities and multipliers have the indices 1, 2 and 3. The index is lower
/// with the differentiated constraint, with the stabilized form of Gear, Gupta and Leimkuhler, and with a
/// compliant constraint.
#[test]
fn constrained_mechanics_by_formulation() {
    let mass = dmatrix![2.0, 0.5; 0.5, 1.0];
    let stiffness = dmatrix![3.0, -1.0; -1.0, 2.0];
    let b = dmatrix![1.0, -2.0];
    let i = DMatrix::<f64>::identity(2, 2);
    // The unknowns are q, v, λ.
    let mut e = direct_sum(&[i.clone(), mass.clone(), DMatrix::zeros(1, 1)]);
    let mut a = DMatrix::zeros(5, 5);
    a.view_mut((0, 2), (2, 2)).copy_from(&-&i);
    a.view_mut((2, 0), (2, 2)).copy_from(&stiffness);
    a.view_mut((2, 4), (2, 1)).copy_from(&-b.transpose());

    a.view_mut((4, 0), (1, 2)).copy_from(&b);
    assert_indices(&e, &a, 3, &[1, 1, 2, 2, 3]);

    a[(4, 4)] = 1e-5;
    assert_indices(&e, &a, 1, &[0, 0, 0, 0, 1]);

    a[(4, 4)] = 0.0;
    a.view_mut((4, 0), (1, 2)).fill(0.0);
    a.view_mut((4, 2), (1, 2)).copy_from(&b);
    assert_indices(&e, &a, 2, &[0, 0, 1, 1, 2]);

    // The constraint is compliant and differentiated, ṗ/κ + B v = 0, so the system is an ordinary differential
    // equation.
    e[(4, 4)] = 1e-5;
    let compliant_velocity = structure(e.clone(), a.clone());
    assert_eq!(compliant_velocity.index, Index::Decided(0));
    e[(4, 4)] = 0.0;

    let e = direct_sum(&[e, DMatrix::zeros(1, 1)]);
    let mut a = a.resize(6, 6, 0.0);
    a.view_mut((5, 0), (1, 2)).copy_from(&b);
    a.view_mut((0, 5), (2, 1)).copy_from(&b.transpose());
    assert_indices(&e, &a, 2, &[1, 1, 1, 1, 2, 2]);
}

#[test]
fn singular_pencils_have_no_index() {
    // An equation occurs twice, so no number of differentiations determines all unknowns.
    let twice = structure(dmatrix![1.0, 2.0; 1.0, 2.0], dmatrix![3.0, 4.0; 3.0, 4.0]);
    assert_eq!(twice.index, Index::Singular { nullity: 1 });
    assert!(twice.variables.is_empty());
    // One unknown does not occur in any equation.
    let absent = structure(dmatrix![1.0, 0.0; 0.0, 0.0], dmatrix![1.0, 0.0; 1.0, 0.0]);
    assert_eq!(absent.index, Index::Singular { nullity: 1 });
    // This is an ordinary differential equation with dependent constraints: the two rows of B are equal up to a
    // factor.
    let b = dmatrix![1.0, 1.0, 0.0; 2.0, 2.0, 0.0];
    let e = direct_sum(&[DMatrix::identity(3, 3), DMatrix::zeros(2, 2)]);
    let mut a = DMatrix::zeros(5, 5);
    a.view_mut((3, 0), (2, 3)).copy_from(&b);
    a.view_mut((0, 3), (3, 2)).copy_from(&-b.transpose());
    assert_eq!(structure(e, a).index, Index::Singular { nullity: 1 });
}

/// With random non-singular P and Q, the pencil P (E, A) Q has the index of its Weierstrass form, which is the
/// size of the largest nilpotent block. Other units of rows, columns and time do not change the index.
#[test]
fn random_transformations_of_weierstrass_forms() {
    let mut rng = StdRng::seed_from_u64(20090711);
    for _ in 0..200 {
        let n_ode = rng.random_range(0..6);
        let n_blocks = rng.random_range(0..4);
        let sizes: Vec<usize> =
            (0..n_blocks).map(|_| *[1, 1, 2, 3, 4].choose(&mut rng).unwrap()).collect();
        let index = sizes.iter().copied().max().unwrap_or(0);
        let n = n_ode + sizes.iter().sum::<usize>();
        if n == 0 {
            continue;
        }
        let jordan: Vec<_> = sizes.iter().map(|&size| nilpotent(size)).collect();
        let e = direct_sum(&[DMatrix::identity(n_ode, n_ode), direct_sum(&jordan)]);
        let ode = DMatrix::from_fn(n_ode, n_ode, |_, _| rng.random_range(-3.0..3.0));
        let a = direct_sum(&[ode, DMatrix::identity(n - n_ode, n - n_ode)]);
        let (p, q) = (well_conditioned(n, &mut rng), well_conditioned(n, &mut rng));
        let (e, a) = (&p * e * &q, &p * a * &q);
        let plain = structure(e.clone(), a.clone());
        assert_eq!(plain.index, Index::Decided(index), "{sizes:?} {plain:#?}");
        let tau = 10f64.powf(rng.random_range(-6.0..6.0));
        let (rows, columns) = (units(n, &mut rng), units(n, &mut rng));
        let scaled = structure(&rows * e * &columns * tau, &rows * a * &columns);
        assert_eq!(scaled.index, Index::Decided(index), "{sizes:?} {scaled:#?}");
        assert_eq!(indices(&plain), indices(&scaled));
        assert_eq!(indices(&plain).into_iter().max().unwrap_or(0) as usize, index);
    }
}

/// If a block of E is close to the level of rounding errors, the index must not be decided.
#[test]
fn an_index_close_to_rounding_is_undecided() {
    let mut rng = StdRng::seed_from_u64(1);
    let n = 6;
    let (p, q) = (well_conditioned(n, &mut rng), well_conditioned(n, &mut rng));
    let index_with = |tiny: f64| {
        let mut e = DMatrix::identity(n, n);
        e[(n - 1, n - 1)] = tiny;
        structure(&p * e * &q, &p * &q).index
    };
    assert_eq!(index_with(0.0), Index::Decided(1));
    assert_eq!(index_with(1e-3), Index::Decided(0));
    // The transformation reduces the block by two more decades, to 5e-11 of E after scaling.
    assert!(matches!(index_with(1e-8), Index::Undecided(Some(_))));
}

/// Checks the magnitudes of soft tissue in SI units on a grid: masses of 1e-3 kg, stiffnesses of 1e4 Pa, volumes of
/// 1e-3 m², and a bulk modulus κ. The result is correct even if the bulk modulus is a million times the bulk modulus
/// of muscle.
#[test]
fn physical_magnitudes() {
    let m = 6;
    let (nq, np) = (m * m, 7);
    let n = 2 * nq + np;
    let grid = |diagonal: f64, neighbor: f64| {
        DMatrix::from_fn(nq, nq, |i, j| match (i / m).abs_diff(j / m) + (i % m).abs_diff(j % m) {
            0 => diagonal,
            1 => neighbor,
            _ => 0.0,
        })
    };
    let b = DMatrix::from_fn(np, nq, |i, j| {
        let near = (5 * i..5 * i + 12).contains(&(j + 3));
        if near { 1e-3 * ((7 * i + 13 * j) as f64).sin() } else { 0.0 }
    });
    let i = DMatrix::<f64>::identity(nq, nq);
    let e = direct_sum(&[i.clone(), grid(1e-3, 1e-4), DMatrix::zeros(np, np)]);
    let mut a = DMatrix::zeros(n, n);
    a.view_mut((0, nq), (nq, nq)).copy_from(&-i);
    a.view_mut((nq, 0), (nq, nq)).copy_from(&grid(4.1e4, -1e4));
    a.view_mut((nq, 2 * nq), (nq, np)).copy_from(&-b.transpose());
    a.view_mut((2 * nq, 0), (np, nq)).copy_from(&b);
    for inv_kappa in [0.0, 1e-5, 1e-11] {
        a.view_mut((2 * nq, 2 * nq), (np, np)).fill_diagonal(1e-4 * inv_kappa);
        let found = structure(e.clone(), a.clone());
        let expected = if inv_kappa == 0.0 { (3, [1, 2, 3]) } else { (1, [0, 0, 1]) };
        assert_eq!(found.index, Index::Decided(expected.0));
        assert!(found.gap() > 6.0, "{:.1} decades at 1/κ = {inv_kappa:e}", found.gap());
        let blocks = [0..nq, nq..2 * nq, 2 * nq..n].map(|block| found.block(block).index);
        assert_eq!(blocks, expected.1);
    }
}

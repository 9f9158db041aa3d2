//! Tests of the rod: identities, Jacobian, closed forms, and reference case S8.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod analytic;

use std::f64::consts::{PI, TAU};

use myovib_fem::FemError;
use myovib_fem::rod::{EndLoad, Rod, RodData};
use nalgebra::{Complex, DMatrix, DVector};
use nalgebra_sparse::CscMatrix;
use serde_json::Value;

use analytic::{discrete_natural_frequency, harmonic_response, natural_frequency};

type Complex64 = Complex<f64>;

fn references() -> Value {
    serde_json::from_str(include_str!("../../../../data/references/s8_rod_harmonic.json")).unwrap()
}

/// Returns scattered numbers in (−1, 1).
fn scattered(seed: f64, n: usize) -> Vec<f64> {
    (1..=n).map(|k| (seed + 12.9898 * k as f64 * k as f64).sin()).collect()
}

fn rod(n_elements: usize) -> Rod {
    Rod::new(RodData { n_elements, ..RodData::default() }).unwrap()
}

/// Returns the name and the value of the invalid parameter.
fn parameter<T: std::fmt::Debug>(result: Result<T, FemError>) -> (&'static str, f64) {
    match result {
        Err(FemError::Parameter { name, value, .. }) => (name, value),
        other => panic!("{other:?} instead of an invalid parameter"),
    }
}

fn residual(rod: &Rod, s: &[f64], s_dot: &[f64], end_force: f64) -> Vec<f64> {
    let mut residual = vec![f64::NAN; rod.n_states()];
    rod.residual(s, s_dot, end_force, &mut residual);
    residual
}

fn jacobian(rod: &Rod, a: f64, b: f64) -> DMatrix<f64> {
    let pattern = rod.jacobian_pattern().clone();
    let mut values = vec![f64::NAN; pattern.nnz()];
    rod.jacobian(a, b, &mut values);
    let sparse = CscMatrix::try_from_pattern_and_values(pattern, values).unwrap();
    DMatrix::from(&sparse)
}

#[test]
fn matrices_are_exact_for_linear_displacements() {
    for n in [1, 2, 10] {
        let rod = rod(n);
        let (mass, stiffness) = (DMatrix::from(rod.mass()), DMatrix::from(rod.stiffness()));
        assert_eq!(mass, mass.transpose());
        assert_eq!(stiffness, stiffness.transpose());
        // ∫ ρ u² = ρ L³/3 for the linear function u = x, which the elements represent exactly.
        let x = DVector::from_fn(n, |j, _| 0.1 * (j + 1) as f64 / n as f64);
        let second_moment = (x.transpose() * &mass * &x)[0];
        assert!((second_moment - 1e3 * 1e-3 / 3.0).abs() < 1e-14, "{n}: {second_moment}");
        // ∫ EA u_x² = EA L for the same u, up to the rounding of EA/h.
        let energy = (x.transpose() * &stiffness * &x)[0];
        assert!((energy - 1e5).abs() < 1e-15 * 1e5 * 8.0 * n as f64, "{n}: {energy}");
    }
}

#[test]
fn jacobian_matches_differences_of_the_residual() {
    for (n, a, b) in [(1, 0.7, 31.0), (2, -1.3, 0.4), (10, 1.0, 2500.0)] {
        let rod = rod(n);
        let jacobian = jacobian(&rod, a, b);
        let (s, s_dot) = (scattered(0.3, 2 * n), scattered(1.7, 2 * n));
        let base = residual(&rod, &s, &s_dot, 5.0);
        // The residual is affine, so a full step is exact up to the rounding of its largest terms, 2 EA/h.
        let rounding = 32.0 * f64::EPSILON * (2e6 / 0.1 * n as f64) * (1.0 + a.abs());
        for column in 0..2 * n {
            let (mut s, mut s_dot) = (s.clone(), s_dot.clone());
            s[column] += a;
            s_dot[column] += b;
            let moved = residual(&rod, &s, &s_dot, 5.0);
            for row in 0..2 * n {
                let slope = moved[row] - base[row];
                assert!((jacobian[(row, column)] - slope).abs() < rounding, "({row}, {column})");
            }
        }
    }
}

#[test]
fn power_balances_energy_rate_and_dissipation() {
    let rod = rod(10);
    let (s, end_force) = (scattered(0.1, 20), 3e4);
    let (q, v) = s.split_at(10);
    let v_dot = scattered(0.9, 10);
    let r = residual(&rod, &s, &[v, &v_dot].concat(), end_force);
    let imbalance: f64 = v.iter().zip(&r[10..]).map(|(v, r)| v * r).sum();
    // Derivative of the energy along ṡ = (v, v̇). The energy is quadratic, so a central difference is exact.
    let energy = |h: f64| {
        let moved = |x: &[f64], d: &[f64]| -> Vec<f64> {
            x.iter().zip(d).map(|(x, d)| x + h * d).collect()
        };
        rod.energy(&[moved(q, v), moved(v, &v_dot)].concat())
    };
    let gained = (energy(1.0) - energy(-1.0)) / 2.0;
    // The value vᵀ (α M + β A) v follows from the energy, which is ½ vᵀMv at (0, v) and ½ vᵀAv at (v, 0).
    let zero = [0.0; 10];
    let lost = 2.0 * (0.25 * rod.energy(&[&zero, v].concat()))
        + 2.0 * (1e-3 * rod.energy(&[v, &zero].concat()));
    let power = end_force * v[9];
    // The error is the rounding of energies of order n EA/h.
    assert!((imbalance - (gained + lost - power)).abs() < 1e9 * 64.0 * f64::EPSILON);
}

#[test]
fn interpolation_is_linear_and_exact_at_nodes() {
    let rod = rod(10);
    let q: Vec<f64> = (1..=10).map(f64::from).collect();
    for (x, value) in
        [(0.0, 0.0), (0.004, 0.4), (0.01, 1.0), (0.05, 5.0), (0.0875, 8.75), (0.1, 10.0)]
    {
        let point = rod.displacement_at(x).unwrap();
        assert!((point.of(&q) - value).abs() < 16.0 * f64::EPSILON * 10.0, "x = {x}");
    }
    assert_eq!(rod.displacement_at(0.05).unwrap().entries, [(4, 1.0)]);
    assert_eq!(rod.displacement_at(0.0).unwrap().entries, []);
    for outside in [-1e-9, 0.1000001, f64::NAN] {
        assert!(rod.displacement_at(outside).is_err(), "{outside}");
    }
    assert_eq!(parameter(rod.displacement_at(0.2)), ("x", 0.2));
}

#[test]
fn discrete_modes_satisfy_the_closed_form() {
    for n in [1, 2, 10] {
        let rod = rod(n);
        let (mass, stiffness) = (DMatrix::from(rod.mass()), DMatrix::from(rod.stiffness()));
        for k in 1..=n {
            let phi = (k as f64 - 0.5) * PI / n as f64;
            let mode = DVector::from_fn(n, |j, _| ((j + 1) as f64 * phi).sin());
            let squared = (TAU * discrete_natural_frequency(rod.data(), k)).powi(2);
            let residual = &stiffness * &mode - squared * (&mass * &mode);
            // The error is the rounding of the terms of A, 4 EA/h.
            assert!(residual.amax() < 16.0 * f64::EPSILON * 4e7 * n as f64, "{n} {k}: {residual}");
        }
    }
}

#[test]
fn natural_frequencies_match_the_published_values() {
    let data = RodData::default();
    let published = references()["eigenfrequencies_rad_s_exact"].clone();
    for (k, omega) in published.as_array().unwrap().iter().enumerate() {
        let omega = omega.as_f64().unwrap();
        let found = TAU * natural_frequency(&data, k + 1);
        assert!((found - omega).abs() < 8.0 * f64::EPSILON * omega, "{k}: {found} {omega}");
    }
    // The values agree to the published digits.
    assert!((natural_frequency(&data, 1) - 79.06).abs() < 0.005);
    assert!((discrete_natural_frequency(&data, 1) - 79.14).abs() < 0.005);
    // To leading order, linear elements overestimate the frequency of each mode by φ²/24.
    for n_elements in [50, 100] {
        let fine = RodData { n_elements, ..data };
        let excess = discrete_natural_frequency(&fine, 1) / natural_frequency(&data, 1) - 1.0;
        let leading = (PI / 2.0 / n_elements as f64).powi(2) / 24.0;
        // The next term is smaller by a factor φ² < 1e-3.
        assert!((excess / leading - 1.0).abs() < 1e-3, "{excess:e} {leading:e}");
    }
}

/// Returns the steady states (Q, V) under τ = e^{iωt}. They are computed from the residual and the Jacobian alone:
/// (∂F/∂s + iω ∂F/∂ṡ) S = −F(0, 0) with the complex force.
fn steady_states(rod: &Rod, load: EndLoad, frequency: f64) -> DVector<Complex64> {
    let omega = TAU * frequency;
    let (df_ds, df_ds_dot) = (jacobian(rod, 1.0, 0.0), jacobian(rod, 0.0, 1.0));
    let system = df_ds.zip_map(&df_ds_dot, |s, s_dot| Complex64::new(s, omega * s_dot));
    let rest = vec![0.0; rod.n_states()];
    // At t = 0, e^{iωt} corresponds to τ = 1 and τ̇ = iω.
    let part = |tau, tau_dot| residual(rod, &rest, &rest, rod.end_force(load, tau, tau_dot));
    let (real, imaginary) = (part(1.0, 0.0), part(0.0, omega));
    let load = DVector::from_fn(rod.n_states(), |i, _| -Complex64::new(real[i], imaginary[i]));
    system.lu().solve(&load).unwrap()
}

#[test]
fn closed_form_response_matches_the_published_value() {
    for (key, load) in [("strain_form", EndLoad::Strain), ("traction_form", EndLoad::Traction)] {
        let published = &references()[key]["U_mid"];
        let (re, im) = (published[0].as_f64().unwrap(), published[1].as_f64().unwrap());
        let found = harmonic_response(&RodData::default(), load, 8.0, 0.05);
        // The reference values have 15 digits.
        assert!((found - Complex64::new(re, im)).norm() < 1e-15 * 0.0506 * 2.0, "{key}: {found}");
    }
}

#[test]
fn ten_elements_approximate_the_closed_form_response() {
    for load in [EndLoad::Strain, EndLoad::Traction] {
        let distance = |n_elements: usize| {
            let rod = rod(n_elements);
            let middle = rod.displacement_at(0.05).unwrap();
            let steady = steady_states(&rod, load, 8.0);
            let u: Complex64 = middle.entries.iter().map(|&(j, w)| steady[j] * w).sum();
            let exact = harmonic_response(rod.data(), load, 8.0, 0.05);
            (u - exact).norm() / exact.norm()
        };
        let (ten, twenty) = (distance(10), distance(20));
        // The published relative error, to its two digits.
        assert!((ten - 2.5e-7).abs() < 0.05e-7, "{load:?}: {ten:e}");
        // The convergence at a node is of second order. The next term is smaller by O(h²).
        assert!((ten / twenty - 4.0).abs() < 0.01, "{load:?}: {}", ten / twenty);
    }
}

#[test]
fn load_interpretations_differ_as_published() {
    let [strain, traction] = [EndLoad::Strain, EndLoad::Traction]
        .map(|load| harmonic_response(&RodData::default(), load, 8.0, 0.05));
    // The published differences are 0.1 % in amplitude and 0.050 rad in phase.
    assert!((strain.norm() / traction.norm() - 1.001).abs() < 5e-4);
    assert!((strain.arg() - traction.arg() - 0.050).abs() < 5e-4);
}

#[test]
fn invalid_data_are_rejected() {
    let data = RodData::default();
    let density = RodData { density: -1.0, ..data };
    assert_eq!(parameter(Rod::new(density)), ("density", -1.0));
    let damping = RodData { stiffness_damping: f64::NAN, ..data };
    let (name, value) = parameter(Rod::new(damping));
    assert!(name == "stiffness_damping" && value.is_nan());
    let empty = RodData { n_elements: 0, ..data };
    assert_eq!(parameter(Rod::new(empty)), ("n_elements", 0.0));
}

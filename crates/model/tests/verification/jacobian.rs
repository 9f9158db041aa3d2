//! The Jacobian of every formulation compared with central differences of its residual.

use myovib_conformance::jacobian_error;
use myovib_dae::{Problem, VariableKind};
use myovib_fem::Law;
use myovib_model::{Field, Formulation, MuscleDae, Signal, paper};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::common::{LAWS, loaded_block};

fn dae(formulation: Formulation, law: Law, kappa: f64, beta: f64) -> MuscleDae {
    MuscleDae::for_analysis(loaded_block(0, law, kappa, beta, Signal::paper(1e3)), formulation)
}

/// Returns a random state with moderate strains in which all fields have typical magnitudes, and these magnitudes.
fn random_state(dae: &MuscleDae, rng: &mut StdRng) -> (Vec<f64>, Vec<f64>) {
    let size = dae.layout().fill(|field| match field {
        Field::Displacement => 0.05,
        Field::Velocity => 1.0,
        Field::Pressure => 1e3,
        Field::PressureRate => 1e4,
        Field::GglMultiplier => 1.0,
        Field::Tension | Field::InternalStress => 1e3,
    });
    let mut draw = |factor: f64| -> Vec<f64> {
        size.iter().map(|s| factor * s * rng.random_range(-1.0..1.0)).collect()
    };
    (draw(1.0), draw(10.0))
}

/// Returns max_i |J δ - dF/dε|_i relative to the sum of the row's terms, along a random direction.
fn discrepancy(dae: &mut MuscleDae, rng: &mut StdRng) -> f64 {
    let (y, y_dot) = random_state(dae, rng);
    let (direction, _) = random_state(dae, rng);
    let (a, b) = (rng.random_range(0.5..2.0), rng.random_range(1.0..1e3));
    jacobian_error(dae, 0.9, [&y, &y_dot, &direction], [a, b])
}

#[test]
fn jacobian_of_every_formulation_agrees_with_differences() {
    let mut rng = StdRng::seed_from_u64(28);
    for formulation in Formulation::ALL {
        for law in LAWS {
            for kappa in [1e5, f64::INFINITY] {
                for beta in [0.0, 1e-2] {
                    if formulation == Formulation::Displacement && kappa.is_infinite() {
                        continue;
                    }
                    let mut dae = dae(formulation, law, kappa, beta);
                    for _ in 0..3 {
                        let error = discrepancy(&mut dae, &mut rng);
                        // Central differences with ε = 1e-5 for strains of 5e-2·ε/h have truncation errors below 1e-8,
                        // and rounding errors of 1e-16/ε = 1e-11 times the ratio of the terms of a row, which is at
                        // most 1e3 for b up to 1e3.
                        assert!(
                            error < 1e-7,
                            "{formulation} {law:?} kappa={kappa} beta={beta}: {error:e}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn jacobian_is_affine_in_a_and_b() {
    let mut rng = StdRng::seed_from_u64(7);
    for formulation in Formulation::ALL {
        let mut dae = dae(formulation, paper::LAW, 1e5, 1e-2);
        let (y, y_dot) = random_state(&dae, &mut rng);
        let mut at = |a: f64, b: f64| {
            let mut values = vec![0.0; dae.jacobian_pattern().nnz()];
            dae.jacobian(0.9, &y, &y_dot, a, b, &mut values).unwrap();
            values
        };
        let (value, rate, both) = (at(1.0, 0.0), at(0.0, 1.0), at(2.0, 300.0));
        for ((v, r), w) in value.iter().zip(&rate).zip(&both) {
            // A sum of two products: three roundings.
            let scale = (2.0 * v).abs() + (300.0 * r).abs();
            assert!((2.0 * v + 300.0 * r - w).abs() <= 8.0 * f64::EPSILON * scale);
        }
    }
}

/// Each formulation with allowed parameters, and whether its equations contain a rate of the
/// pressure.
#[test]
fn algebraic_unknowns_have_no_rate_in_the_equations() {
    const INF: f64 = f64::INFINITY;
    let mut rng = StdRng::seed_from_u64(3);
    for (formulation, kappa, beta) in [
        (Formulation::Displacement, 1e5, 0.0),
        (Formulation::Position, 1e5, 0.0),
        (Formulation::Position, INF, 0.0),
        (Formulation::Rate, 1e5, 1e-2),
        (Formulation::Rate, INF, 1e-2),
        (Formulation::Velocity, 1e5, 0.0),
        (Formulation::Velocity, INF, 0.0),
        (Formulation::Stabilized, INF, 0.0),
        (Formulation::ImplicitRate, 1e5, 1e-2),
        (Formulation::ImplicitRate, INF, 1e-2),
    ] {
        let muscle = loaded_block(0, paper::LAW, kappa, beta, Signal::paper(1e3));
        let mut dae = MuscleDae::new(muscle, formulation).unwrap();
        let (y, y_dot) = random_state(&dae, &mut rng);
        let pattern = dae.jacobian_pattern();
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(0.9, &y, &y_dot, 0.0, 1.0, &mut values).unwrap();
        let kinds = dae.kinds().unwrap();
        for &(field, _) in formulation.rows() {
            let columns = dae.layout().range(field).unwrap();
            let mut entries = pattern.entries().zip(&values);
            let has_rate = entries.any(|((c, _), v)| columns.contains(&c) && *v != 0.0);
            let differential = kinds[columns.start] == VariableKind::Differential;
            assert_eq!(differential, has_rate, "{formulation} kappa = {kappa}: {field}");
        }
    }
}

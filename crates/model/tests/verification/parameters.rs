//! Parameters out of range, and incompatible formulations.

use myovib_model::equation::{Added, Context, Equation, PressureRateSource};
use myovib_model::{Field, Formulation, ModelError, MuscleDae, Parameters, Probe, Signal, paper};

use crate::common::loaded_block;

#[test]
fn parameters_out_of_range_are_named_with_the_range() {
    for (alpha, beta, kappa, words) in [
        (0.0, 0.0, 0.0, "bulk modulus = 0"),
        (0.0, 0.0, -1e5, "bulk modulus = -100000"),
        (0.0, 0.0, f64::NAN, "bulk modulus = NaN"),
        (0.0, -1e-4, 1e5, "stiffness-proportional damping = -0.0001"),
        (0.0, f64::INFINITY, 1e5, "stiffness-proportional damping = inf"),
        (-1.0, 0.0, 1e5, "mass-proportional damping = -1"),
    ] {
        let message = Parameters::new(alpha, beta, kappa).unwrap_err().to_string();
        assert!(message.starts_with(words), "{message}");
    }
    assert!(Parameters::new(1.0, 0.0, f64::INFINITY).unwrap().is_incompressible());
}

#[test]
fn incompatible_formulations_list_the_compatible_ones() {
    use Formulation::{Displacement, ImplicitRate, Position, Rate, Stabilized, Velocity};
    const INF: f64 = f64::INFINITY;
    for (formulation, kappa, beta, words) in [
        (Displacement, INF, 0.0, "finite κ"),
        (Position, 1e5, 1e-4, "β = 0"),
        (Velocity, INF, 1e-4, "β = 0"),
        (Rate, INF, 0.0, "β > 0"),
        (Rate, 1e5, 0.0, "β > 0"),
        (Stabilized, 1e5, 0.0, "κ = inf"),
        (Stabilized, INF, 1e-4, "β = 0"),
        (ImplicitRate, INF, 0.0, "β > 0"),
    ] {
        let muscle = loaded_block(0, paper::LAW, kappa, beta, Signal::constant(0.0));
        let message = MuscleDae::new(muscle, formulation).unwrap_err().to_string();
        assert!(message.contains(formulation.name()) && message.contains(words), "{message}");
    }
}

#[test]
fn a_point_outside_the_mesh_is_named() {
    let muscle = loaded_block(0, paper::LAW, 1e5, 0.0, Signal::constant(0.0));
    let error = Probe::at(muscle.solid.space(), [3.0, 0.5]).unwrap_err();
    assert!(matches!(error, ModelError::OutsideMesh { .. }), "{error}");
}

#[test]
fn formulations_go_by_their_names_and_the_papers_numbers() {
    let expected = [
        ("displacement", "18"),
        ("position", "28"),
        ("rate", "29"),
        ("velocity", "31"),
        ("stabilized", "33"),
        ("implicit-rate", "26"),
    ];
    for (formulation, (name, equation)) in Formulation::ALL.into_iter().zip(expected) {
        assert_eq!((formulation.name(), formulation.equation()), (name, equation));
        assert_eq!(formulation.to_string(), name);
        assert_eq!(serde_json::to_value(formulation).unwrap(), name);
    }
}

#[test]
fn the_limit_index_is_that_of_the_incompressible_body() {
    for formulation in Formulation::ALL {
        for &(field, _) in formulation.rows() {
            for beta in [0.0, 1e-4] {
                let limit = Parameters::new(0.0, beta, f64::INFINITY).unwrap();
                assert_eq!(
                    formulation.limit_index(field, beta > 0.0),
                    formulation.variable_index(field, &limit),
                    "{formulation} {field}"
                );
            }
        }
    }
}

fn context(beta: f64, inv_kappa: f64) -> Context {
    Context {
        alpha: 0.0,
        beta,
        inv_kappa,
        has_pressure: true,
        pressure_rate: PressureRateSource::None,
        pressed: false,
        added: Added::default(),
        graded: false,
        coherence: false,
    }
}

#[test]
fn without_damping_no_rate_of_the_force_is_computed() {
    let needs = |beta| Equation::Momentum.needs(&context(beta, 0.0));
    assert!(!needs(0.0).force_rate && needs(1e-4).force_rate);
}

#[test]
fn incompressible_constraints_have_no_entries_for_the_pressure() {
    for equation in [Equation::Constraint, Equation::ConstraintRate] {
        let of_pressure = |inv_kappa| {
            let terms = equation.terms(&context(0.0, inv_kappa));
            terms.iter().filter(|t| t.column == Field::Pressure).count()
        };
        assert_eq!((of_pressure(0.0), of_pressure(1e-5)), (0, 1));
    }
}

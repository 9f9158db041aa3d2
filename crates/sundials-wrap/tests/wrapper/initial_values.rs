//! Search for consistent initial values.

use myovib_conformance::samples::{
    Heat2d, MechanicalForm, ParametricSample, Pendulum, Robertson, Sample,
};
use myovib_dae::{Outcome, Problem, StepError, Suppressed, VariableKind};
use sundials_wrap::{ConsistencyMode, Error, IdaOptions, IdaSolver, SensitivityOptions};

use crate::common::tolerance;

/// SUNDIALS' example corrects a boundary value of 0.1. The corrected value must be 0, and the derivatives in the
/// interior must be consistent with it.
#[test]
fn wrong_algebraic_values_are_repaired() {
    let sample = Heat2d::new(10);
    let start = sample.start();
    let mut wrong = start.y.clone();
    for (value, kind) in wrong.iter_mut().zip(sample.kinds().unwrap()) {
        if kind == VariableKind::Algebraic {
            *value = 0.1;
        }
    }
    // The components excluded from the error test differ from the algebraic components.
    let mut excluded = vec![false; 100];
    excluded[55] = true;
    let options = IdaOptions { suppressed: Suppressed::Components(excluded), ..tolerance(1e-8) };
    let mut solver =
        IdaSolver::builder(sample).options(options).build(0.0, &wrong, &[0.0; 100]).unwrap();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    solver.correct_initial_values(mode, 0.01).unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
    for ((ours, exact), kind) in
        solver.y_dot().iter().zip(&start.y_dot).zip(sample.kinds().unwrap())
    {
        // The bound is the tolerance of Newton's method for y, times 4/Δx² = 324.
        let wanted = kind == VariableKind::Differential;
        assert!(!wanted || (ours - exact).abs() < 324.0 * 1e-8, "{ours} ≠ {exact}");
    }
    assert_eq!(solver.integrate_to(0.01).unwrap(), Outcome::Reached { t: 0.01 });
}

#[test]
fn consistent_values_of_robertson_are_found() {
    let start = Robertson.start();
    let builder = IdaSolver::builder(Robertson).options(tolerance(1e-8));
    let mut solver = builder.build(0.0, &[1.0, 0.0, 0.3], &[0.0; 3]).unwrap();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    solver.correct_initial_values(mode, 0.4).unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
    for (ours, exact) in solver.y_dot()[..2].iter().zip(&start.y_dot) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
}

/// A double layer of capacitance 1, discharged through a resistance of 0.1 by a current with exponential kinetics:
/// q̇ = −j, j = sinh(20 (φ − 3.7)), φ = 4 − 0.1 j.
struct Electrode;

impl Problem for Electrode {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let (current, potential) = (y[1], y[2]);
        r[0] = v[0] + current;
        r[1] = current - (20.0 * (potential - 3.7)).sinh();
        r[2] = potential - 4.0 + 0.1 * current;
        Ok(())
    }
}

/// Regression test: IDACalcIC did not converge.
#[test]
fn consistent_values_of_exponential_kinetics_are_found() {
    let builder = IdaSolver::builder(Electrode).options(tolerance(1e-8));
    let mut solver = builder.build(0.0, &[1.0, 0.0, 3.7], &[0.0; 3]).unwrap();
    solver.correct_initial_values(ConsistencyMode::AlgebraicAndDerivatives, 1.0).unwrap();
    let (y, y_dot) = (solver.y().to_vec(), solver.y_dot().to_vec());
    // Solution of j = sinh(6 − 2 j); it has nine digits.
    let exact = 2.22916783;
    assert_eq!(y[0], 1.0);
    assert!((y[1] - exact).abs() < 1e-8, "{y:?}");
    assert!((y[2] - (4.0 - 0.1 * exact)).abs() < 1e-8, "{y:?}");
    assert!((y_dot[0] + exact).abs() < 1e-8, "{y_dot:?}");
}

/// Sensitivities must satisfy the differentiated constraints, which the correction does not compute.
#[test]
fn sensitivities_are_not_corrected_onto_constraints() {
    let pendulum = Pendulum::new(MechanicalForm::Index2);
    let (start, parameters) = (pendulum.start(), pendulum.differenced());
    let starts = vec![[vec![0.0; 5], vec![0.0; 5]]; 2];
    let mut solver = IdaSolver::builder(pendulum)
        .sensitivities(parameters, SensitivityOptions::default(), starts)
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let error = solver.correct_initial_values(ConsistencyMode::Constraints, 1.0).unwrap_err();
    assert!(matches!(error, Error::SensitivitiesNotCorrected), "{error}");
}

/// The temperature is computed from its rate of change, by the discrete Poisson equation.
#[test]
fn states_are_found_from_derivatives() {
    let start = Heat2d::new(10).start();
    let builder = IdaSolver::builder(Heat2d::new(10)).options(tolerance(1e-10));
    let mut solver = builder.build(0.0, &[0.0; 100], &start.y_dot).unwrap();
    solver.correct_initial_values(ConsistencyMode::States, 0.01).unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-10, "{ours} ≠ {exact}");
    }
    assert_eq!(solver.y_dot(), start.y_dot);
}

//! Multipliers of index 3 in the first steps.

#![allow(clippy::unwrap_used)] // a test may panic

use myovib_conformance::samples::{
    CarAxis, Charges, Constrained, Differentiated, FourBar, MechanicalForm, Mechanism, Pendulum,
    Press, Sample, SliderCrank, SphericalPendulums,
};
use myovib_dae::{Outcome, Tolerances, VariableKind};
use myovib_radau::{RadauOptions, RadauSolver};
use nalgebra::{DMatrix, DVector};

/// Number of checked steps.
const FIRST_STEPS: usize = 4;

/// Bound for the multiplier errors in units of the tolerance, as in `digits.rs`.
const PROMISED: f64 = 100.0;

/// Function that creates a mechanism with its constraints in the given form.
type Form = Box<dyn Fn(MechanicalForm) -> Box<dyn Sample>>;

fn mechanism<M: Mechanism + Copy + 'static>(mechanism: M) -> Form {
    Box::new(move |form| Box::new(Differentiated::new(Constrained::new(mechanism, form))))
}

/// Returns the mechanisms with their end times.
fn mechanisms() -> Vec<(&'static str, Form, f64)> {
    vec![
        ("pendulum", Box::new(|form| Box::new(Pendulum::new(form))), 2.0),
        ("car axis", Box::new(|form| Box::new(CarAxis::new(form))), 1.0),
        ("slider-crank", mechanism(SliderCrank), 0.3),
        ("four-bar", mechanism(FourBar), 0.5),
        ("press", mechanism(Press), 0.01),
        ("spherical pendulums", mechanism(SphericalPendulums), 1.0),
        ("charges", mechanism(Charges), 2.0),
    ]
}

/// Returns the multipliers at (t, q, v). The equations of index 1 are linear in the multipliers and in v̇.
fn exact_multipliers(index_1: &mut dyn Sample, t: f64, y: &[f64], n: usize) -> Vec<f64> {
    let m = y.len() - 2 * n;
    let mut residual = |x: &[f64]| {
        let at = [&y[..2 * n], &x[n..]].concat();
        let rates = [&y[n..2 * n], &x[..n], &vec![0.0; m]].concat();
        let mut r = vec![0.0; y.len()];
        index_1.residual(t, &at, &rates, &mut r).unwrap();
        DVector::from_column_slice(&r[n..])
    };
    let mut x = vec![0.0; n + m];
    let constant = residual(&x);
    let mut matrix = DMatrix::zeros(n + m, n + m);
    for j in 0..n + m {
        x[j] = 1.0;
        matrix.set_column(j, &(residual(&x) - &constant));
        x[j] = 0.0;
    }
    let solution = matrix.lu().solve(&-constant).unwrap();
    solution.as_slice()[n..].to_vec()
}

/// Returns the largest error of the multipliers after the next steps, in units of the tolerance.
fn error_of_next_steps(
    solver: &mut RadauSolver<Box<dyn Sample>>,
    index_1: &mut dyn Sample,
    (n, end): (usize, f64),
    tolerance: f64,
) -> f64 {
    let mut largest = 0.0_f64;
    for _ in 0..FIRST_STEPS {
        let outcome = solver.step(end).unwrap();
        assert!(matches!(outcome, Outcome::StepTaken { .. }), "{outcome:?}");
        let exact = exact_multipliers(index_1, solver.t(), solver.y(), n);
        for (multiplier, exact) in solver.y()[2 * n..].iter().zip(&exact) {
            let error = (multiplier - exact).abs() / (tolerance * (1.0 + exact.abs()));
            // A NaN is treated as larger than every bound.
            largest = if error <= largest { largest } else { error };
        }
    }
    largest
}

/// Regression test: in the first steps, multipliers were wrong by up to 1e11 tolerances, because the rounding errors of
/// the constraint are divided by h².
#[test]
fn multipliers_are_accurate_from_the_first_step() {
    let mut wrong = Vec::new();
    for (name, form, end) in mechanisms() {
        for stages in [3, 5, 7] {
            for tolerance in [1e-4, 1e-6, 1e-8] {
                let sample = form(MechanicalForm::Index3);
                let mut index_1 = form(MechanicalForm::Index1);
                let start = sample.start();
                let kinds = sample.kinds().unwrap();
                let is_differential = |kind: &&VariableKind| **kind == VariableKind::Differential;
                let n = kinds.iter().filter(is_differential).count() / 2;
                let options = RadauOptions {
                    stages,
                    tolerances: Tolerances::scalar(tolerance, tolerance),
                    ..RadauOptions::default()
                };
                let builder = RadauSolver::builder(sample).options(options);
                let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
                let largest = error_of_next_steps(&mut solver, &mut *index_1, (n, end), tolerance);
                if largest >= PROMISED || largest.is_nan() {
                    wrong.push(format!("{name}, {stages} stages, {tolerance:e}: {largest:.0e}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

//! Runs of samples, and reference numbers from `data/references/`.

use myovib_radau::{RadauOptions, RadauSolver};
use serde_json::Value;
use sundials_wrap::samples::Sample;
use sundials_wrap::{Outcome, Tolerances};

/// A reference file of the repository.
pub(crate) fn reference(name: &str) -> Value {
    let path = format!(
        "{}/../../data/references/{name}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).expect("the reference file is in the repository");
    serde_json::from_str(&text).expect("the reference file is JSON")
}

/// An array of numbers.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    let entries = value.as_array().expect("an array");
    entries
        .iter()
        .map(|v| v.as_f64().expect("a number"))
        .collect()
}

/// The same tolerance, relative and absolute.
pub(crate) fn tolerance(tol: f64) -> RadauOptions {
    RadauOptions {
        tolerances: Tolerances::scalar(tol, tol),
        ..RadauOptions::default()
    }
}

/// A solver at the start of a sample.
pub(crate) fn solver<S: Sample>(sample: S, options: RadauOptions) -> RadauSolver<S> {
    let start = sample.start();
    RadauSolver::builder(sample)
        .options(options)
        .build(start.t, &start.y, &start.y_dot)
        .expect("the options are good")
}

/// The solver after a run to `t_end`.
pub(crate) fn run<S: Sample>(sample: S, t_end: f64, options: RadauOptions) -> RadauSolver<S> {
    let mut solver = solver(sample, options);
    let outcome = solver
        .integrate_to(t_end)
        .expect("the problem raises no errors");
    assert_eq!(outcome, Outcome::Reached { t: t_end });
    solver
}

/// Mixed-error significant correct digits: −log10 of the largest error relative to 1 + |reference|.
pub(crate) fn mescd(y: &[f64], reference: &[f64]) -> f64 {
    let errors = y
        .iter()
        .zip(reference)
        .map(|(y, r)| (y - r).abs() / (1.0 + r.abs()));
    -errors.fold(0.0, f64::max).log10()
}

/// Significant correct digits: −log10 of the largest relative error.
pub(crate) fn scd(y: &[f64], reference: &[f64]) -> f64 {
    let errors = y.iter().zip(reference).map(|(y, r)| ((y - r) / r).abs());
    -errors.fold(0.0, f64::max).log10()
}

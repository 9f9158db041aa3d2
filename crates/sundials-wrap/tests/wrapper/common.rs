//! Common functions of the tests: reference values, solvers for samples, Jacobians from difference quotients.

use myovib_conformance::samples::Sample;
use myovib_dae::{Problem, Tolerances};
use serde_json::Value;
use sundials_wrap::{IdaOptions, IdaSolver};

/// Whether the linear systems are solved by KLU, which estimates condition numbers.
pub(crate) const HAS_KLU: bool = !cfg!(feature = "vendored");

/// Returns a reference file of the repository.
pub(crate) fn reference(name: &str) -> Value {
    let path = format!("{}/../../data/references/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("the reference file is in the repository");
    serde_json::from_str(&text).expect("the reference file is JSON")
}

/// Returns an array of numbers.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    let entries = value.as_array().expect("an array");
    entries.iter().map(|v| v.as_f64().expect("a number")).collect()
}

/// Compares the Jacobian of a problem, for two pairs (a, b), with central differences of the residual.
pub(crate) fn check_jacobian(
    problem: &mut (impl Problem + ?Sized),
    t: f64,
    y: &[f64],
    y_dot: &[f64],
) {
    let n = problem.n_unknowns();
    let pattern = problem.jacobian_pattern();
    for (a, b) in [(1.0, 37.0), (0.6, -2.5)] {
        let mut values = vec![f64::NAN; pattern.nnz()];
        problem.jacobian(t, y, y_dot, a, b, &mut values).unwrap();
        let mut dense = vec![0.0; n * n];
        for ((column, row), &value) in pattern.entries().zip(&values) {
            dense[column * n + row] = value;
        }
        for j in 0..n {
            // The cube root of ε is the step that balances truncation and rounding.
            let h = 6e-6 * y[j].abs().max(y_dot[j].abs()).max(1e-3);
            let mut side = |sign: f64| {
                let (mut y, mut y_dot) = (y.to_vec(), y_dot.to_vec());
                y[j] += sign * a * h;
                y_dot[j] += sign * b * h;
                let mut residual = vec![0.0; n];
                problem.residual(t, &y, &y_dot, &mut residual).unwrap();
                residual
            };
            let (plus, minus) = (side(1.0), side(-1.0));
            let scale = dense[j * n..][..n].iter().fold(1e-8_f64, |m, v| m.max(v.abs()));
            for i in 0..n {
                let difference = (plus[i] - minus[i]) / (2.0 * h);
                let value = dense[j * n + i];
                // The error of second-order differences of smooth terms is 1e-6 of the largest entry of the column.
                assert!(
                    (difference - value).abs() < 1e-6 * scale,
                    "entry ({i}, {j}) for a = {a}, b = {b}: {value} ≠ {difference}"
                );
            }
        }
    }
}

/// Returns a solver that starts from the initial values of the sample.
pub(crate) fn build<S: Sample>(sample: S, options: IdaOptions) -> IdaSolver<S> {
    let start = sample.start();
    IdaSolver::builder(sample).options(options).build(start.t, &start.y, &start.y_dot).unwrap()
}

/// Returns options with `tolerance` as the relative and the absolute tolerance, and with an unlimited number of steps.
pub(crate) fn tolerance(tolerance: f64) -> IdaOptions {
    let tolerances = Tolerances::scalar(tolerance, tolerance);
    IdaOptions { tolerances, max_steps: None, ..IdaOptions::default() }
}

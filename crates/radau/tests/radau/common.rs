//! Common functions: runs of samples, and reference values from `data/references/`.

use myovib_conformance::AnyProblem;
use myovib_conformance::samples::{Sample, Start};
use myovib_dae::{Outcome, Problem, StepError, Stop, Tolerances, VariableKind};
use myovib_radau::{RadauBuilder, RadauOptions, RadauSolver};
use nalgebra_sparse::pattern::SparsityPattern;
use serde_json::Value;

/// Returns a reference file of the repository.
pub(crate) fn reference(name: &str) -> Value {
    let path = format!("{}/../../data/references/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("the reference file is in the repository");
    serde_json::from_str(&text).expect("the reference file is JSON")
}

/// Returns the stop with which an integration must have ended. An entry of the Jacobian must not be reported as wrong.
#[track_caller]
pub(crate) fn stopped(outcome: Outcome) -> Box<Stop> {
    let stop = stopped_with_any_jacobian(outcome);
    assert_eq!(stop.wrong_entry, None, "{stop}");
    stop
}

/// Returns the stop with which an integration must have ended. The Jacobian may be wrong.
#[track_caller]
pub(crate) fn stopped_with_any_jacobian(outcome: Outcome) -> Box<Stop> {
    match outcome {
        Outcome::Stopped(stop) => stop,
        other => panic!("not stopped: {other:?}"),
    }
}

/// Returns an array of numbers.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    let entries = value.as_array().expect("an array");
    entries.iter().map(|v| v.as_f64().expect("a number")).collect()
}

/// Returns options with `tol` as the relative and the absolute tolerance.
pub(crate) fn tolerance(tol: f64) -> RadauOptions {
    RadauOptions { tolerances: Tolerances::scalar(tol, tol), ..RadauOptions::default() }
}

/// Returns a builder for a boxed problem, so that the solver is compiled only once for all problems.
pub(crate) fn radau(problem: impl Problem + 'static) -> RadauBuilder<AnyProblem> {
    let problem: AnyProblem = Box::new(problem);
    RadauSolver::builder(problem)
}

/// Returns a solver that starts from the initial values of a sample. It is compiled only once for all samples.
pub(crate) fn solver(
    sample: impl Sample + 'static,
    options: RadauOptions,
) -> RadauSolver<Box<dyn Sample>> {
    let start = sample.start();
    let sample: Box<dyn Sample> = Box::new(sample);
    started(sample, &start, options)
}

/// Returns a solver for a sample of a known type, which sensitivities require.
pub(crate) fn solver_of<S: Sample>(sample: S, options: RadauOptions) -> RadauSolver<S> {
    let start = sample.start();
    started(sample, &start, options)
}

fn started<P: Problem>(problem: P, start: &Start, options: RadauOptions) -> RadauSolver<P> {
    RadauSolver::builder(problem)
        .options(options)
        .build(start.t, &start.y, &start.y_dot)
        .expect("the options are good")
}

/// Returns the solver after a run to `t_end`.
pub(crate) fn run(
    sample: impl Sample + 'static,
    t_end: f64,
    options: RadauOptions,
) -> RadauSolver<Box<dyn Sample>> {
    let mut solver = solver(sample, options);
    let outcome = solver.integrate_to(t_end).expect("the problem raises no errors");
    assert_eq!(outcome, Outcome::Reached { t: t_end });
    solver
}

/// Returns the number of mixed-error significant correct digits: −log10 of the largest error relative to
/// 1 + |reference|.
pub(crate) fn mescd(y: &[f64], reference: &[f64]) -> f64 {
    let errors = y.iter().zip(reference).map(|(y, r)| (y - r).abs() / (1.0 + r.abs()));
    -largest(errors).log10()
}

/// Returns the number of significant correct digits: −log10 of the largest relative error.
pub(crate) fn scd(y: &[f64], reference: &[f64]) -> f64 {
    let errors = y.iter().zip(reference).map(|(y, r)| ((y - r) / r).abs());
    -largest(errors).log10()
}

/// Returns the largest error.
///
/// # Panics
/// Panics if an error is NaN. `f64::max` would ignore it, and the number of digits would be overestimated.
fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |largest, error| {
        assert!(!error.is_nan(), "an error is NaN");
        f64::max(largest, error)
    })
}

/// The system ẋ = v, v̇ = −x with x = sin t, for which Newton's method converges in one iteration for any step size.
pub(crate) struct Oscillator;

impl Problem for Oscillator {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r.copy_from_slice(&[v[0] - y[1], v[1] + y[0]]);
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1])
            .unwrap()
    }

    fn jacobian(
        &mut self,
        _: f64,
        _: &[f64],
        _: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        values.copy_from_slice(&[b, a, -a, b]);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential; 2])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0; 2])
    }
}

impl Sample for Oscillator {
    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![0.0, 1.0], y_dot: vec![1.0, 0.0] }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        Some(vec![t.sin(), t.cos()])
    }
}

/// A sample without its Jacobian. Difference quotients depend on the weights and on the step size at the time of the
/// evaluation.
#[derive(Clone)]
pub(crate) struct WithoutJacobian<S>(pub(crate) S);

impl<S: Problem> Problem for WithoutJacobian<S> {
    fn n_unknowns(&self) -> usize {
        self.0.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.0.residual(t, y, v, r)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.0.jacobian_pattern()
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.0.indices()
    }
}

impl<S: Sample> Sample for WithoutJacobian<S> {
    fn start(&self) -> Start {
        self.0.start()
    }
}

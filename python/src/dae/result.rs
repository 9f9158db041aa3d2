//! Result of an integration and its conversion to Python objects.

use myovib_dae::{Remedy, Statistics, Unsatisfied};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::problem::array;

/// Result of an integration.
#[derive(Default)]
pub(super) struct Record {
    pub(super) t: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
    /// Sensitivities ∂y/∂p_j for each time and each parameter.
    pub(super) dy_dp: Vec<f64>,
    /// Index of the event, time and solution of each crossing.
    pub(super) events: Vec<(usize, f64, Vec<f64>)>,
    /// Start and end of each step; empty unless `dense` is true.
    pub(super) segments: Vec<f64>,
    /// Values of y at the interpolation nodes of each step.
    pub(super) samples: Vec<f64>,
    /// 0 if the end of the span was reached, 1 after a terminal event, −1 if the integrator failed or reached
    /// `max_steps`.
    pub(super) status: i8,
    pub(super) message: String,
    /// Equation violated within a step, if any.
    pub(super) unsatisfied: Option<Unsatisfied>,
    /// Warnings, each with its subject: `jacobian` for a Jacobian that seems to be wrong, or `input` for an input that
    /// varies faster than the steps.
    pub(super) warnings: Vec<(&'static str, String)>,
    pub(super) statistics: Statistics,
}

impl Record {
    pub(super) fn push(&mut self, t: f64, y: &[f64], y_dot: &[f64]) {
        self.t.push(t);
        self.y.extend_from_slice(y);
        self.y_dot.extend_from_slice(y_dot);
    }
}

/// Returns the `degree + 1` Chebyshev–Lobatto points on [−1, 1], in ascending order.
pub(super) fn nodes(degree: usize) -> Vec<f64> {
    let angle = |k: usize| std::f64::consts::PI * k as f64 / degree as f64;
    (0..=degree).map(|k| -angle(k).cos()).collect()
}

/// Replaces names of the Rust API in a message by the corresponding arguments of `solve_dae`.
pub(super) fn in_python(message: &str) -> String {
    let at_break = Remedy::RestartAtBreak.to_string();
    let names = [
        ("call correct_initial_values", "request initial=\"algebraic\""),
        ("correct_initial_values", "initial=\"algebraic\""),
        (
            at_break.as_str(),
            "listing in `breaks` (or `events`, if they depend on y) nearby times at which an input jumps or has a kink",
        ),
        ("(initial_step)", "(first_step)"),
        ("(suppressed)", "(suppress)"),
        ("(Suppressed::FromIndex(2))", "(suppress)"),
        ("Problem::indices", "index="),
        // Constraints can only be stated in Rust.
        (
            "; or defining the constraints (Problem::constraints) and correcting the initial values by them",
            "",
        ),
    ];
    let rename = |message: String, (ours, python): (&str, &str)| message.replace(ours, python);
    names.into_iter().fold(message.to_owned(), rename)
}

/// Converts the record to a dictionary of arrays in row-major order.
pub(super) fn result(py: Python<'_>, record: Record, degree: usize) -> PyResult<Bound<'_, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("t", array(py, &record.t))?;
    result.set_item("y", array(py, &record.y))?;
    result.set_item("yp", array(py, &record.y_dot))?;
    result.set_item("dy_dp", array(py, &record.dy_dp))?;
    result.set_item("segments", array(py, &record.segments))?;
    result.set_item("samples", array(py, &record.samples))?;
    result.set_item("warnings", record.warnings)?;
    result.set_item("nodes", array(py, &nodes(degree)))?;
    let crossings = record.events.iter();
    let events: Vec<_> = crossings.map(|(k, t, y)| (*k, *t, array(py, y))).collect();
    result.set_item("events", events)?;
    result.set_item("status", record.status)?;
    result.set_item("message", in_python(&record.message))?;
    let s = &record.statistics;
    for (name, count) in [
        ("nfev", s.residual_evaluations + s.difference_evaluations),
        ("njev", s.jacobian_evaluations),
        ("nlu", s.linear_setups),
        ("nsteps", s.steps),
        ("nni", s.newton_iterations),
        ("netf", s.error_test_failures),
        ("ncfn", s.step_solve_failures),
        ("ngev", s.root_evaluations),
    ] {
        result.set_item(name, count)?;
    }
    Ok(result)
}

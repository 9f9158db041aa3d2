//! Checks of the arguments before an integration, and of the equations within steps.

use std::sync::PoisonError;

use myovib_dae::{
    Integrator, Linearization, Tolerances, Unsatisfied, check_between, check_jacobian,
    check_pattern,
};
use myovib_sparse::resources;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use super::{Failure, Request};
use crate::problem::PythonDae;

/// Clears an exception that a trial evaluation has raised, because such a failure must not end the integration. Returns
/// exceptions such as `KeyboardInterrupt` as an error.
pub(super) fn forget_raised(problem: &PythonDae) -> Result<(), Failure> {
    let raised = problem.raised.lock();
    match raised.unwrap_or_else(PoisonError::into_inner).take() {
        Some(error) if !Python::attach(|py| error.is_instance_of::<PyException>(py)) => {
            Err(Failure::Raised(error))
        }
        _ => Ok(()),
    }
}

/// Rejects a sparsity pattern if finite differences show that it is incomplete. Returns a warning if the given Jacobian
/// seems to be wrong.
pub(super) fn check_matrices(
    problem: &mut PythonDae,
    request: &Request,
    tolerances: &Tolerances,
) -> Result<Option<String>, Failure> {
    if problem.pattern.is_none() && problem.jacobian.is_none() {
        return Ok(None);
    }
    let mut weights = vec![0.0; problem.n];
    tolerances.write_weights(&request.y0, &mut weights);
    let at = Linearization {
        t: request.t_span.0,
        y: &request.y0,
        y_dot: &request.yp0,
        // With a very short step, the perturbations of the variables are equal to their tolerances.
        step: f64::MIN_POSITIVE.copysign(request.t_span.1 - request.t_span.0),
        weights: &weights,
    };
    if problem.jacobian.is_some() {
        let wrong = check_jacobian(problem, &at).err();
        forget_raised(problem)?;
        return Ok(wrong.map(|wrong| wrong.to_string()));
    }
    let checked = check_pattern(problem, &at);
    forget_raised(problem)?;
    match checked {
        Ok(()) => Ok(None),
        Err(missing) => Err(Failure::Argument(format!("sparsity: {missing}"))),
    }
}

/// Positions within a step at which the equations are checked, as fractions of the step. Successive steps use them in
/// turn.
const FRACTIONS: [f64; 3] = [0.31, 0.62, 0.87];

/// Number of first steps, which are all checked. Later steps are checked only if their number is a power of two.
pub(super) const FIRST_STEPS: usize = 12;

/// Checks the equations within the last step, whose number is `n_steps`. Returns a violated equation, if any.
pub(super) fn check_last_step<I: Integrator<PythonDae>>(
    solver: &mut I,
    tolerances: &Tolerances,
    n_steps: usize,
) -> Result<Option<Unsatisfied>, Failure> {
    let [from, to] = solver.last_step_interval();
    let n = solver.y().len();
    let [mut y, mut y_dot, mut weights] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let t = from + FRACTIONS[n_steps % FRACTIONS.len()] * (to - from);
    for (derivative, out) in [&mut y, &mut y_dot].into_iter().enumerate() {
        solver.dense_output(t, derivative, out).map_err(Failure::of)?;
    }
    tolerances.write_weights(&y, &mut weights);
    match check_between(solver.problem_mut(), (t, &y, &y_dot), to - from, &weights) {
        Ok(found) => Ok(found),
        // F may be undefined at this point.
        Err(_) => {
            forget_raised(solver.problem())?;
            Ok(None)
        }
    }
}

/// Rejects full matrices that do not fit into memory.
pub(super) fn expect_room(n: usize, method: &str) -> Result<(), Failure> {
    // Number of 8-byte values per entry of the matrix. BDF stores two copies of the pattern during construction, the
    // matrix, its factors, and the user's two parts. Radau IIA stores the pattern, its analysis, both parts, and the
    // entries, factors and workspace of the real matrix and of (s - 1)/2 complex matrices. Complex matrices have two
    // values per entry.
    let per_entry: f64 = match method {
        "bdf" => 6.0,
        "radau5" => 18.0,
        "radau9" => 25.0,
        _ => 32.0,
    };
    let needed = per_entry * 8.0 * (n as f64).powi(2);
    match resources::available() {
        Some(available) if needed > available as f64 => Err(Failure::Memory(format!(
            "full matrices of {n} unknowns need about {:.1} GiB, and {:.1} GiB are free: give the pattern of the \
             Jacobian as `sparsity`",
            needed / GIB,
            available as f64 / GIB,
        ))),
        _ => Ok(()),
    }
}

const GIB: f64 = (1_u64 << 30) as f64;

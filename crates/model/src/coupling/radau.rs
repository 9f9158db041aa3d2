//! Radau IIA for a body or a coupled system.

use myovib_dae::{Problem, Suppressed, Tolerances};
use myovib_radau::{RadauOptions, SparseDirectSolver};
use myovib_sparse::SparseOptions;

use super::body::{Body, SystemMatrices};
use super::error_test::ErrorTest;
use crate::error::ModelError;
use crate::integration::radau::RadauIntegrator;
use crate::integration::settings::LinearSolverKind;

impl<P: Body> RadauIntegrator<P, SystemMatrices<P>> {
    /// Starts the integration of a system over `[t, t_end]` from a state with consistent derivatives.
    ///
    /// `error_test` replaces the tolerances and the excluded components of the options.
    ///
    /// # Errors
    /// Returns [`ModelError::Radau`] if an option is invalid, and [`ModelError::OnlyBdf`] for step-dependent weights.
    pub fn coupled_at(
        mut system: P,
        error_test: impl Into<Option<ErrorTest>>,
        options: RadauOptions,
        linear_solver: LinearSolverKind,
        [t, t_end]: [f64; 2],
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let matrices = matrices(&mut system, options.sparse, linear_solver)?;
        let schedule = system.schedule();
        let times = (t, t_end);
        let integrator = match error_test.into() {
            None => Self::new(system, matrices, options, times, y, y_dot)?,
            Some(test) => tested(system, matrices, test, options, times, (y, y_dot))?,
        };
        Ok(integrator.with_schedule(schedule))
    }
}

/// Returns the solver for the Newton systems. It is condensed if this is requested and the system allows it.
///
/// # Errors
/// Returns [`ModelError::Factorization`] if the pattern cannot be analyzed.
pub fn matrices<P: Body>(
    system: &mut P,
    options: SparseOptions,
    linear_solver: LinearSolverKind,
) -> Result<SystemMatrices<P>, ModelError> {
    let condensed = match linear_solver {
        LinearSolverKind::Condensed => system.condensed_solver(options)?,
        LinearSolverKind::Full => None,
    };
    Ok(match condensed {
        Some(solver) => solver,
        None => Box::new(SparseDirectSolver::new(&system.jacobian_pattern(), options)?),
    })
}

/// Builds the integrator with component-wise error weights.
fn tested<P: Problem, M: myovib_dae::LinearSolver<P>>(
    problem: P,
    matrices: M,
    error_test: ErrorTest,
    options: RadauOptions,
    times: (f64, f64),
    state: (&[f64], &[f64]),
) -> Result<RadauIntegrator<P, M>, ModelError> {
    if error_test.step_size().is_some() {
        let setting = "multiplier_weights";
        return Err(ModelError::OnlyBdf { setting });
    }
    let options = RadauOptions {
        // Newton's tolerance depends on this value; the weights below replace it in the error test.
        tolerances: Tolerances::scalar(error_test.smallest_relative(), 0.0),
        suppressed: Suppressed::Components(error_test.excluded().to_vec()),
        ..options
    };
    let test = error_test.scaled(|relative| options.internal_factor(relative));
    RadauIntegrator::with_weights(problem, matrices, options, times, state, move |y, w| {
        test.weights(y, w);
    })
}

//! IDAS for coupled systems.

use myovib_dae::{Problem, Suppressed};

use sundials_wrap::{IdaBuilder, IdaOptions};

use super::body::Body;
use super::error_test::ErrorTest;
use crate::error::ModelError;
use crate::integration::ida::{IdaIntegrator, builder};
use crate::integration::settings::LinearSolverKind;

impl<P: Body> IdaIntegrator<P> {
    /// Starts a coupled system from a state with consistent derivatives over the time interval
    /// `[start, end]`. Factorizes the full Newton matrix if the body has no condensed solver.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for invalid IDAS options.
    pub fn coupled_at(
        mut system: P,
        error_test: ErrorTest,
        options: IdaOptions,
        linear_solver: LinearSolverKind,
        [t, t_end]: [f64; 2],
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let condensed = match linear_solver {
            LinearSolverKind::Condensed => system.condensed_solver(options.sparse)?,
            LinearSolverKind::Full => None,
        };
        let schedule = system.schedule();
        let step_size = error_test.step_size();
        let mut builder = tested(system, error_test, options, t_end);
        if let Some(solver) = condensed {
            builder = builder.linear_solver(solver);
        }
        let solver = builder.build(t, y, y_dot)?;
        Ok(Self::of(solver, t_end, schedule, step_size))
    }
}

/// Builds the integrator with component-wise error weights.
fn tested<P: Problem>(
    problem: P,
    error_test: ErrorTest,
    options: IdaOptions,
    t_end: f64,
) -> IdaBuilder<P> {
    let options = IdaOptions {
        // Replaced by the weights below: tolerances of the body alone would have the wrong length.
        tolerances: IdaOptions::default().tolerances,
        suppressed: Suppressed::Components(error_test.excluded().to_vec()),
        ..options
    };
    builder(problem, options, t_end).error_weights(move |_, y, weights| {
        error_test.weights(y, weights);
        Ok(())
    })
}

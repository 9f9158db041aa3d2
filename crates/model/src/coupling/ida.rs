//! IDAS for a body or a coupled system.

use myovib_dae::Suppressed;

use sundials_wrap::IdaOptions;

use super::body::Body;
use super::error_test::ErrorTest;
use crate::error::ModelError;
use crate::integration::ida::{IdaIntegrator, builder};
use crate::integration::settings::LinearSolverKind;

impl<P: Body> IdaIntegrator<P> {
    /// Starts the integration of a system over `[t, t_end]` from a state with consistent derivatives. Factorizes the
    /// full Newton matrix if this is requested or if the system has no condensed solver.
    ///
    /// `error_test` replaces the tolerances and the excluded components of the options.
    ///
    /// # Errors
    /// Returns [`ModelError::Integrator`] if an option of IDAS is invalid.
    pub fn coupled_at(
        mut system: P,
        error_test: impl Into<Option<ErrorTest>>,
        mut options: IdaOptions,
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
        let test = error_test.into();
        let step_size = test.as_ref().and_then(ErrorTest::step_size);
        if let Some(test) = &test {
            // The weights below replace the tolerances. Tolerances of the body alone would have the wrong length.
            options.tolerances = IdaOptions::default().tolerances;
            options.suppressed = Suppressed::Components(test.excluded().to_vec());
        }
        let mut builder = builder(system, options, t_end);
        if let Some(test) = test {
            builder = builder.error_weights(move |_, y, weights| {
                test.weights(y, weights);
                Ok(())
            });
        }
        if let Some(solver) = condensed {
            builder = builder.linear_solver(solver);
        }
        let solver = builder.build(t, y, y_dot)?;
        Ok(Self::of(solver, t_end, schedule, step_size))
    }
}

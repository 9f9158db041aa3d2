//! IDAS for coupled systems.

use myovib_dae::{Problem, Suppressed};

use sundials_wrap::{IdaBuilder, IdaOptions};

use super::body::Body;
use super::dae::CoupledDae;
use super::error_test::ErrorTest;
use super::feedback::FeedbackDae;
use super::feedback_solver::FeedbackSolver;
use super::solver::CoupledSolver;
use crate::error::ModelError;
use crate::integration::ida::{IdaIntegrator, builder};
use crate::integration::settings::LinearSolver;
use crate::start::Consistent;

impl<B: Body> IdaIntegrator<CoupledDae<B>> {
    /// Starts a coupled system at t = 0 from `y`, the body at rest.
    ///
    /// The tolerances, and what the error test leaves out, are those of `error_test`. A load that
    /// does not start from zero is met by consistent initial derivatives.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for options IDAS does not take, [`ModelError::Evaluation`] when
    /// the equations cannot be evaluated at t = 0.
    pub fn coupled(
        mut dae: CoupledDae<B>,
        error_test: ErrorTest,
        options: IdaOptions,
        linear_solver: LinearSolver,
        t_end: f64,
        y: &[f64],
    ) -> Result<Self, ModelError> {
        let [y, y_dot] = dae.consistent(0.0, y)?;
        let times = [0.0, t_end];
        Self::coupled_at(dae, error_test, options, linear_solver, times, &y, &y_dot)
    }

    /// Starts a coupled system from a state with consistent derivatives, over the times
    /// `[start, end]`.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for options IDAS does not take.
    pub fn coupled_at(
        dae: CoupledDae<B>,
        error_test: ErrorTest,
        options: IdaOptions,
        linear_solver: LinearSolver,
        [t, t_end]: [f64; 2],
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let of_body = match linear_solver {
            LinearSolver::Condensed => dae.body().condensed_solver(options.klu)?,
            LinearSolver::Full => None,
        };
        let condensed = of_body
            .map(|body| CoupledSolver::new(body, &dae, options.klu))
            .transpose()?;
        let schedule = dae.schedule();
        let step_size = error_test.step_size();
        let mut builder = tested(dae, error_test, options, t_end);
        if let Some(solver) = condensed {
            builder = builder.linear_solver(solver);
        }
        let solver = builder.build(t, y, y_dot)?;
        Ok(Self::of(solver, t_end, schedule, step_size))
    }
}

impl IdaIntegrator<FeedbackDae> {
    /// Starts a muscle with feedback from a state with consistent derivatives, over the times
    /// `[start, end]`. Its oscillators are eliminated where they act on their own elements alone; else
    /// its Newton matrices are factorised as a whole.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for options IDAS does not take.
    pub fn feedback_at(
        mut dae: FeedbackDae,
        error_test: ErrorTest,
        options: IdaOptions,
        linear_solver: LinearSolver,
        [t, t_end]: [f64; 2],
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let schedule = dae.one_way().schedule();
        let step_size = error_test.step_size();
        let eliminated = match linear_solver {
            LinearSolver::Condensed => FeedbackSolver::new(&mut dae, options.klu)?,
            LinearSolver::Full => None,
        };
        let mut builder = tested(dae, error_test, options, t_end);
        if let Some(solver) = eliminated {
            builder = builder.linear_solver(solver);
        }
        let solver = builder.build(t, y, y_dot)?;
        Ok(Self::of(solver, t_end, schedule, step_size))
    }
}

/// A system of parts, each of which the error test looks at in its own way.
fn tested<P: Problem>(
    problem: P,
    error_test: ErrorTest,
    options: IdaOptions,
    t_end: f64,
) -> IdaBuilder<P> {
    let options = IdaOptions {
        // Replaced by the weights below; those of a body alone have another length.
        tolerances: IdaOptions::default().tolerances,
        suppressed: Suppressed::Components(error_test.left_out().to_vec()),
        ..options
    };
    builder(problem, options, t_end).error_weights(move |_, y, weights| {
        error_test.weights(y, weights);
        Ok(())
    })
}

//! Radau IIA for coupled systems.

use myovib_dae::{Problem, Suppressed, Tolerances};
use myovib_radau::{KluMatrices, RadauOptions};

use super::body::Body;
use super::dae::CoupledDae;
use super::error_test::ErrorTest;
use super::feedback::FeedbackDae;
use super::feedback_solver::FeedbackSolver;
use super::solver::CoupledSolver;
use crate::error::ModelError;
use crate::integration::radau::RadauIntegrator;
use crate::integration::settings::LinearSolver;
use crate::start::Consistent;

/// Matrices chosen at run time: by the body's own, or of the whole.
pub type SystemMatrices<B> = Box<dyn myovib_dae::LinearSolver<CoupledDae<B>>>;

/// The same where the oscillators act back.
pub type FeedbackMatrices = Box<dyn myovib_dae::LinearSolver<FeedbackDae>>;

impl<B: Body> RadauIntegrator<CoupledDae<B>, SystemMatrices<B>> {
    /// Starts a coupled system at t = 0 from `y`, the body at rest, as
    /// IDAS does.
    ///
    /// # Errors
    /// [`ModelError::Radau`] for options Radau IIA does not take, [`ModelError::Integrator`] when
    /// no consistent derivatives are found, [`ModelError::Evaluation`] when the equations cannot be
    /// evaluated at t = 0.
    pub fn coupled(
        mut dae: CoupledDae<B>,
        error_test: ErrorTest,
        options: RadauOptions,
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
    /// The tolerances, and what the error test leaves out, are those of `error_test`.
    ///
    /// # Errors
    /// [`ModelError::Radau`] for options Radau IIA does not take.
    pub fn coupled_at(
        dae: CoupledDae<B>,
        error_test: ErrorTest,
        options: RadauOptions,
        linear_solver: LinearSolver,
        [t, t_end]: [f64; 2],
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let of_body = match linear_solver {
            LinearSolver::Condensed => dae.body().condensed_solver(options.klu)?,
            LinearSolver::Full => None,
        };
        let matrices: SystemMatrices<B> = match of_body {
            Some(body) => Box::new(CoupledSolver::new(body, &dae, options.klu)?),
            None => {
                let pattern = dae.jacobian_pattern();
                Box::new(KluMatrices::new(&pattern, options.klu)?)
            }
        };
        let schedule = dae.schedule();
        let (times, state) = ((t, t_end), (y, y_dot));
        let integrator = tested(dae, matrices, error_test, options, times, state)?;
        Ok(integrator.with_schedule(schedule))
    }
}

impl RadauIntegrator<FeedbackDae, FeedbackMatrices> {
    /// Starts a muscle with feedback from a state with consistent derivatives, over the times
    /// `[start, end]`, as IDAS does.
    ///
    /// # Errors
    /// [`ModelError::Radau`] for options Radau IIA does not take.
    pub fn feedback_at(
        mut dae: FeedbackDae,
        error_test: ErrorTest,
        options: RadauOptions,
        linear_solver: LinearSolver,
        [t, t_end]: [f64; 2],
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let eliminated = match linear_solver {
            LinearSolver::Condensed => FeedbackSolver::new(&mut dae, options.klu)?,
            LinearSolver::Full => None,
        };
        let matrices: FeedbackMatrices = match eliminated {
            Some(solver) => Box::new(solver),
            None => Box::new(KluMatrices::new(&dae.jacobian_pattern(), options.klu)?),
        };
        let schedule = dae.one_way().schedule();
        let (times, state) = ((t, t_end), (y, y_dot));
        let integrator = tested(dae, matrices, error_test, options, times, state)?;
        Ok(integrator.with_schedule(schedule))
    }
}

/// A system of parts, each of which the error test looks at in its own way.
pub(crate) fn tested<P: Problem, M: myovib_dae::LinearSolver<P>>(
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
        // What Newton takes its own tolerance from; the weights below replace the others.
        tolerances: Tolerances::scalar(error_test.smallest_relative(), 0.0),
        suppressed: Suppressed::Components(error_test.left_out().to_vec()),
        ..options
    };
    let test = error_test.scaled(|relative| options.internal_factor(relative));
    RadauIntegrator::with_weights(problem, matrices, options, times, state, move |y, w| {
        test.weights(y, w);
    })
}

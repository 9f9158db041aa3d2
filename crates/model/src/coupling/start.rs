//! A coupled system with the integrator of one's choice.

use myovib_radau::RadauOptions;
use sundials_wrap::IdaOptions;

use super::body::Body;
use super::dae::CoupledDae;
use super::error_test::ErrorTest;
use super::feedback::FeedbackDae;
use crate::error::ModelError;
use crate::integration::ida::{self, IdaIntegrator};
use crate::integration::integrator::Integrator;
use crate::integration::radau::{self, RadauIntegrator};
use crate::integration::settings::{IntegratorKind, LinearSolver, Settings};
use crate::muscle_dae::MuscleDae;

/// What the integrators of a coupled system can be told; the error test has the tolerances.
#[derive(Debug, Clone)]
pub struct CoupledOptions {
    /// The integrator, which reads its own options below.
    pub integrator: IntegratorKind,
    /// For IDAS.
    pub ida: IdaOptions,
    /// For Radau IIA.
    pub radau: RadauOptions,
    /// How the linear systems of Newton's method are solved.
    pub linear_solver: LinearSolver,
}

impl CoupledOptions {
    /// For a muscle with `settings` and what it drives.
    pub fn of_muscle(dae: &MuscleDae, settings: &Settings) -> Self {
        Self {
            integrator: settings.integrator,
            ida: ida::options(dae, settings),
            radau: radau::options(dae, settings),
            linear_solver: settings.linear_solver,
        }
    }

    /// For a system without a muscle, which has no shorter way than its own small matrix: the
    /// defaults of the integrator.
    pub fn of_states(integrator: IntegratorKind) -> Self {
        Self {
            integrator,
            ida: IdaOptions::default(),
            radau: RadauOptions {
                stages: integrator.stages().unwrap_or(3),
                ..RadauOptions::default()
            },
            linear_solver: LinearSolver::Full,
        }
    }

    /// The same with a first and a largest step (s); none leaves the choice to the integrator.
    pub fn with_steps(mut self, initial: Option<f64>, largest: Option<f64>) -> Self {
        (self.ida.initial_step, self.radau.initial_step) = (initial, initial);
        (self.ida.max_step, self.radau.max_step) = (largest, largest);
        self
    }
}

/// Starts a coupled system at t = 0 from `y`, the body at rest.
///
/// # Errors
/// As [`IdaIntegrator::coupled`] and [`RadauIntegrator::coupled`].
pub fn start_coupled<B: Body + 'static>(
    dae: CoupledDae<B>,
    error_test: ErrorTest,
    options: CoupledOptions,
    t_end: f64,
    y: &[f64],
) -> Result<Box<dyn Integrator<CoupledDae<B>>>, ModelError> {
    let linear = options.linear_solver;
    Ok(match options.integrator.stages() {
        None => Box::new(IdaIntegrator::coupled(
            dae,
            error_test,
            options.ida,
            linear,
            t_end,
            y,
        )?),
        Some(_) => Box::new(RadauIntegrator::coupled(
            dae,
            error_test,
            options.radau,
            linear,
            t_end,
            y,
        )?),
    })
}

/// Starts a coupled system from a state with consistent derivatives, over the times
/// `[start, end]`.
///
/// # Errors
/// As [`IdaIntegrator::coupled_at`] and [`RadauIntegrator::coupled_at`].
pub fn start_coupled_from<B: Body + 'static>(
    dae: CoupledDae<B>,
    error_test: ErrorTest,
    options: CoupledOptions,
    times: [f64; 2],
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<CoupledDae<B>>>, ModelError> {
    let linear = options.linear_solver;
    Ok(match options.integrator.stages() {
        None => Box::new(IdaIntegrator::coupled_at(
            dae,
            error_test,
            options.ida,
            linear,
            times,
            y,
            y_dot,
        )?),
        Some(_) => Box::new(RadauIntegrator::coupled_at(
            dae,
            error_test,
            options.radau,
            linear,
            times,
            y,
            y_dot,
        )?),
    })
}

/// Starts a muscle with feedback from a state with consistent derivatives, over the times
/// `[start, end]`.
///
/// # Errors
/// As [`IdaIntegrator::feedback_at`] and [`RadauIntegrator::feedback_at`].
pub fn start_with_feedback(
    dae: FeedbackDae,
    error_test: ErrorTest,
    options: CoupledOptions,
    times: [f64; 2],
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<FeedbackDae>>, ModelError> {
    let CoupledOptions { ida, radau, .. } = options;
    Ok(match options.integrator.stages() {
        None => Box::new(IdaIntegrator::feedback_at(
            dae, error_test, ida, times, y, y_dot,
        )?),
        Some(_) => Box::new(RadauIntegrator::feedback_at(
            dae, error_test, radau, times, y, y_dot,
        )?),
    })
}

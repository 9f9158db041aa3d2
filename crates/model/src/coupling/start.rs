//! Starts a coupled system with the selected integrator.

use myovib_radau::RadauOptions;
use sundials_wrap::IdaOptions;

use super::body::Body;
use super::error_test::ErrorTest;
use super::feedback::FeedbackDae;
use crate::error::ModelError;
use crate::integration::ida::{self, IdaIntegrator};
use crate::integration::integrator::Integrator;
use crate::integration::projected::Projected;
use crate::integration::radau::{self, RadauIntegrator};
use crate::integration::settings::{IntegratorKind, LinearSolverKind, Settings, StepOptions};
use crate::muscle_dae::MuscleDae;

/// Options of the integrators of a coupled system. Tolerances are in
/// [`ErrorTest`](super::ErrorTest).
#[derive(Debug, Clone)]
pub struct CoupledOptions {
    /// The integrator. Of the options below, only those of this integrator are used.
    pub integrator: IntegratorKind,
    /// Options of IDAS.
    pub ida: IdaOptions,
    /// Options of Radau IIA.
    pub radau: RadauOptions,
    /// Solution method for the linear systems of Newton's method.
    pub linear_solver: LinearSolverKind,
    /// Time between two projections onto the constraint, s (IDAS only).
    pub projection_interval: Option<f64>,
}

impl CoupledOptions {
    /// Returns the options for a muscle coupled with oscillators, from the `settings` of the muscle's run.
    pub fn of_muscle(dae: &MuscleDae, settings: &Settings) -> Self {
        Self {
            integrator: settings.integrator,
            ida: ida::options(dae, settings),
            radau: radau::options(dae, settings),
            linear_solver: settings.linear_solver,
            projection_interval: settings.projection_interval,
        }
    }

    /// Returns the options for a system without a muscle: the integrator's defaults, and no
    /// condensed linear solver.
    pub fn of_states(integrator: IntegratorKind) -> Self {
        Self {
            integrator,
            ida: IdaOptions::default(),
            radau: RadauOptions {
                stages: integrator.stages().unwrap_or(3),
                ..RadauOptions::default()
            },
            linear_solver: LinearSolverKind::Full,
            projection_interval: None,
        }
    }

    /// Returns the options for separately integrated oscillators.
    pub fn of_oscillators(integrator: IntegratorKind) -> Self {
        Self { linear_solver: LinearSolverKind::Condensed, ..Self::of_states(integrator) }
    }

    /// Sets a constant step (s) of Radau IIA without an error test; `None` selects adaptive steps.
    pub fn with_fixed_step(mut self, step: Option<f64>) -> Self {
        self.radau.step_size = radau::step_size(step);
        self
    }

    /// Sets the options of adaptive steps.
    pub fn with_steps(self, steps: StepOptions) -> Self {
        Self { ida: steps.in_ida(self.ida), radau: steps.in_radau(self.radau), ..self }
    }
}

/// Starts a coupled system at t = 0 from `y` with the body at rest. If a load is not zero at the
/// start, consistent initial values and derivatives are computed.
///
/// # Errors
/// Returns the errors of [`Consistent::consistent`](crate::start::Consistent::consistent) and of
/// [`start_coupled_from`].
pub fn start_coupled<P: Body>(
    mut dae: P,
    error_test: ErrorTest,
    options: CoupledOptions,
    t_end: f64,
    y: &[f64],
) -> Result<Box<dyn Integrator<P>>, ModelError> {
    let [y, y_dot] = dae.consistent(0.0, y)?;
    start_coupled_from(dae, error_test, options, [0.0, t_end], &y, &y_dot)
}

/// Starts the integration of a coupled system over the time interval `times` from a state with consistent derivatives.
///
/// # Errors
/// Returns the errors of [`IdaIntegrator::coupled_at`] and [`RadauIntegrator::coupled_at`], and
/// [`ModelError::OnlyBdf`] for settings that only BDF supports.
pub fn start_coupled_from<P: Body>(
    dae: P,
    error_test: ErrorTest,
    options: CoupledOptions,
    times: [f64; 2],
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<P>>, ModelError> {
    let CoupledOptions { integrator, ida, radau, linear_solver: linear, projection_interval } =
        options;
    let setting = "projection_interval";
    Ok(match (integrator.stages(), projection_interval) {
        (Some(_), Some(_)) => return Err(ModelError::OnlyBdf { setting }),
        (Some(_), None) => {
            Box::new(RadauIntegrator::coupled_at(dae, error_test, radau, linear, times, y, y_dot)?)
        }
        (None, every) => {
            let ida = IdaIntegrator::coupled_at(dae, error_test, ida, linear, times, y, y_dot)?;
            match every {
                Some(every) => Box::new(Projected::new(ida, every)?),
                None => Box::new(ida),
            }
        }
    })
}

/// Starts the integration of a muscle with feedback over the time interval `times` from a state with consistent
/// derivatives.
///
/// # Errors
/// Returns the errors of [`start_coupled_from`], and [`ModelError::NotWithFeedback`] if projections are requested.
pub fn start_with_feedback(
    dae: FeedbackDae,
    error_test: ErrorTest,
    options: CoupledOptions,
    times: [f64; 2],
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<FeedbackDae>>, ModelError> {
    if options.projection_interval.is_some() {
        let setting = "projection_interval";
        return Err(ModelError::NotWithFeedback { setting });
    }
    start_coupled_from(dae, error_test, options, times, y, y_dot)
}

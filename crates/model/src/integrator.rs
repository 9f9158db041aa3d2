//! What the run driver asks of a time integrator; IDAS or Radau IIA.

use myovib_radau::Work;
use sundials_wrap::DaeProblem;

use crate::advice::{Advice, Advised};
use crate::error::ModelError;
use crate::ida::IdaIntegrator;
use crate::muscle_dae::MuscleDae;
use crate::projected::Projected;
use crate::radau::RadauIntegrator;
use crate::settings::Settings;
use crate::statistics::StopReason;

/// What one internal step came to.
#[derive(Debug, Clone, PartialEq)]
pub enum Advance {
    /// A step was accepted; the end time is not reached.
    Stepped,
    /// The end time is reached.
    Finished,
    /// The integrator gave up.
    Stopped {
        /// The cause.
        reason: StopReason,
        /// The cause in words: time, step size, order, the components at fault.
        message: String,
    },
}

/// Counts of an integration, named as in [`Statistics`](crate::Statistics).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[allow(missing_docs)] // the names are those of Statistics, documented there
pub struct Counts {
    pub steps: u64,
    pub error_test_failures: u64,
    pub step_solve_failures: u64,
    pub newton_failures: u64,
    pub newton_iterations: u64,
    pub residual_evaluations: u64,
    pub jacobian_evaluations: u64,
    pub linear_setups: u64,
    pub last_order: u32,
    pub last_step: f64,
    pub radau_work: Option<Work>,
}

/// A variable-step integrator that owns its problem.
pub trait Integrator<P> {
    /// Takes one internal step, at most to the end time.
    ///
    /// # Errors
    /// Misuse and fatal errors of the problem; giving up is [`Advance::Stopped`].
    fn advance(&mut self) -> Result<Advance, ModelError>;

    /// The time reached, s.
    fn time(&self) -> f64;

    /// The solution, or its derivative of the given order, at a time within the last step.
    ///
    /// # Errors
    /// If `t` is outside the last step or the order is too high.
    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError>;

    /// The counts so far.
    fn counts(&self) -> Counts;

    /// The problem.
    fn problem(&self) -> &P;

    /// The problem, for evaluations beside the integration.
    fn problem_mut(&mut self) -> &mut P;
}

/// Starts a muscle at rest at t = 0 with the integrator that `settings` names; when it stops it says
/// what the index has to do with it.
///
/// # Errors
/// Settings the integrator does not take.
pub fn start_at_rest(
    dae: MuscleDae,
    settings: &Settings,
) -> Result<Box<dyn Integrator<MuscleDae>>, ModelError> {
    let zero = vec![0.0; dae.n_unknowns()];
    start_from(dae, settings, 0.0, &zero, &zero)
}

/// Starts a muscle at time `t`, from a state with consistent derivatives, with the integrator that
/// `settings` names.
///
/// # Errors
/// Settings the integrator does not take.
pub fn start_from(
    dae: MuscleDae,
    settings: &Settings,
    t: f64,
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<MuscleDae>>, ModelError> {
    let advice = Advice::new(dae.muscle(), dae.formulation(), settings);
    let integrator: Box<dyn Integrator<MuscleDae>> = match settings.integrator.stages() {
        None => {
            let ida = IdaIntegrator::starting_at(dae, settings, t, y, y_dot)?;
            match settings.project_every {
                Some(every) => Box::new(Projected::new(ida, every)?),
                None => Box::new(ida),
            }
        }
        Some(_) => Box::new(RadauIntegrator::starting_at(dae, settings, t, y, y_dot)?),
    };
    Ok(Box::new(Advised::new(integrator, advice)))
}

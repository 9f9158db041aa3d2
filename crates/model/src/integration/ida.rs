//! IDAS as an [`Integrator`] of a model.

use myovib_dae::{Outcome, Problem, Stop, Suppressed};

use sundials_wrap::{IdaBuilder, IdaOptions, IdaSolver};

use crate::coupling::ErrorTest;
use crate::error::ModelError;
use crate::field::Field;
use crate::integration::integrator::{Advance, Integrator};
use crate::integration::pace::{Bounds, Pace};
use crate::integration::settings::{MultiplierWeights, Settings};
use crate::integration::statistics::Counts;
use crate::integration::step_weights::SharedStepSize;
use crate::muscle_dae::MuscleDae;
use crate::signal::schedule::Schedule;
use crate::start::Consistent;

/// IDAS in one-step mode with a stop time at the end of the run.
pub struct IdaIntegrator<P: Problem> {
    pub(crate) solver: IdaSolver<P>,
    pace: Pace,
    /// Counts up to the last restart.
    before: Counts,
    /// Step size shared with step-dependent error weights.
    step_size: SharedStepSize,
}

impl IdaIntegrator<MuscleDae> {
    /// Starts a muscle at rest at t = 0 with all unknowns and derivatives zero. This is consistent
    /// for loads and prescribed displacements that are zero at the start.
    ///
    /// # Errors
    /// Returns [`ModelError::Integrator`] if a setting of IDAS is invalid.
    pub fn from_rest(dae: MuscleDae, settings: &Settings) -> Result<Self, ModelError> {
        let zero = vec![0.0; dae.n_unknowns()];
        Self::starting_at(dae, settings, 0.0, &zero, &zero)
    }

    /// Starts a muscle at order 1 at time `t` from a state with consistent derivatives.
    ///
    /// # Errors
    /// Returns [`ModelError::Integrator`] if a setting of IDAS is invalid.
    pub fn starting_at(
        dae: MuscleDae,
        settings: &Settings,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let scaled = settings.multiplier_weights == MultiplierWeights::StepScaled;
        let relaxes = dae.layout().range(Field::InternalStress).is_some();
        let test = (scaled || relaxes).then(|| ErrorTest::of_muscle(&dae, settings));
        let options = options(&dae, settings);
        let times = [t, settings.t_end];
        Self::coupled_at(dae, test, options, settings.linear_solver, times, y, y_dot)
    }
}

impl<P: Problem> IdaIntegrator<P> {
    /// Starts `problem` at t = 0 from consistent values.
    ///
    /// # Errors
    /// Returns [`ModelError::Integrator`] if an option of IDAS is invalid.
    pub fn new(
        problem: P,
        options: IdaOptions,
        t_end: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let solver = builder(problem, options, t_end).build(0.0, y, y_dot)?;
        Ok(Self::of(solver, t_end, Schedule::default(), None))
    }

    /// Wraps a solver that stops at `t_end`, together with the `schedule` of its system and the step size that its
    /// weights read.
    pub(crate) fn of(
        solver: IdaSolver<P>,
        t_end: f64,
        schedule: Schedule,
        step_size: Option<SharedStepSize>,
    ) -> Self {
        Self {
            solver,
            pace: Pace::new(schedule, t_end),
            before: Counts::default(),
            step_size: step_size.unwrap_or_default(),
        }
    }

    /// Takes a step. If the initial ẏ suggests too long a time scale, the error test rejects every
    /// attempt at the first step, and IDAS gives up after ten attempts. The integration is then
    /// restarted with a smaller first step.
    fn step_or_start_smaller(&mut self, t_out: f64) -> Result<Outcome, ModelError> {
        let t = self.solver.t();
        let mut ahead = t_out - t;
        for _ in 0..RESTARTS {
            match self.solver.step(t + ahead)? {
                Outcome::Stopped(stop) if of_first_step(&stop) && t + SMALLER * ahead > t => {
                    let (y, y_dot) = (self.solver.y().to_vec(), self.solver.y_dot().to_vec());
                    self.solver.reinit(t, &y, &y_dot, &[])?;
                    ahead *= SMALLER;
                }
                outcome => return Ok(outcome),
            }
        }
        Ok(self.solver.step(t + ahead)?)
    }
}

/// Maximum number of restarts with a smaller first step, and the reduction per restart. The first step of the last
/// attempt is 1e-18 times the original one.
const RESTARTS: usize = 3;
const SMALLER: f64 = 1e-6;

/// Returns whether the integration stopped because the error test rejected every attempt at the first step.
fn of_first_step(stop: &Stop) -> bool {
    let reason = stop.reason == myovib_dae::StopReason::ErrorTestFailures;
    stop.statistics.steps == 0 && reason
}

/// Creates a builder for IDAS whose stop time is `t_end`.
pub(crate) fn builder<P: Problem>(problem: P, options: IdaOptions, t_end: f64) -> IdaBuilder<P> {
    IdaSolver::builder(problem).options(IdaOptions {
        stop_time: Some(t_end),
        // The user of a scene provides no Jacobian.
        check_jacobian_at_stop: false,
        ..options
    })
}

/// Returns the options of IDAS for a muscle with `settings`.
pub fn options(dae: &MuscleDae, settings: &Settings) -> IdaOptions {
    let layout = dae.layout();
    settings.steps.in_ida(IdaOptions {
        tolerances: settings.tolerances(layout),
        suppressed: Suppressed::Components(settings.excluded(layout)),
        max_order: usize::from(settings.max_order),
        delta_cj: settings.delta_cj,
        sparse: settings.sparse_options(),
        vectors: settings.vectors,
        ..IdaOptions::default()
    })
}

impl<P: Consistent> IdaIntegrator<P> {
    /// Restarts at order 1 at time `t` from a consistent state near the current one. The counts accumulate.
    ///
    /// # Errors
    /// Returns an error if no consistent state is found.
    pub(crate) fn restart(&mut self, t: f64) -> Result<(), ModelError> {
        let y = self.solver.y().to_vec();
        let [y, y_dot] = self.solver.problem_mut().consistent(t, &y)?;
        self.before = self.counts();
        Ok(self.solver.reinit(t, &y, &y_dot, &[])?)
    }
}

impl<P: Consistent> Integrator<P> for IdaIntegrator<P> {
    fn pass_jump(&mut self) -> Result<(), ModelError> {
        match self.pace.after_jump(self.solver.t()) {
            Some(after) => self.restart(after),
            None => Ok(()),
        }
    }

    fn advance(&mut self) -> Result<Advance, ModelError> {
        self.pass_jump()?;
        self.step_size.set(self.solver.current_step());
        let Bounds { t_out, stop_time, .. } =
            self.pace.bounds(self.solver.t(), &self.solver.statistics());
        self.solver.set_stop_time(stop_time)?;
        let outcome = self.step_or_start_smaller(t_out)?;
        Ok(Advance::of(outcome, self.pace.t_end()))
    }

    fn time(&self) -> f64 {
        self.solver.t()
    }

    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError> {
        Ok(self.solver.dense_output(t, derivative as usize, out)?)
    }

    /// IDAS provides the difference between the solution and its prediction. At order k and constant step size, this
    /// difference is k + 1 times the local error. The error of a vibration is larger than the sum of the errors of its
    /// steps by about the same factor.
    fn local_error(&mut self, out: &mut [f64]) -> Result<bool, ModelError> {
        self.solver.estimated_local_errors(out)?;
        Ok(true)
    }

    fn counts(&self) -> Counts {
        self.before.followed_by(Counts::from(self.solver.statistics()))
    }

    fn problem(&self) -> &P {
        self.solver.problem()
    }

    fn problem_mut(&mut self) -> &mut P {
        self.solver.problem_mut()
    }
}

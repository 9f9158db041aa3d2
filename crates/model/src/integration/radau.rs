//! Radau IIA as an [`Integrator`] of a model.

use myovib_dae::{Problem, Suppressed};
use myovib_radau::{
    InternalVariableProblem, InternalVariables, RadauBuilder, RadauOptions, RadauSolver,
    SparseDirectSolver, StepSize,
};

use crate::coupling::{ErrorTest, SystemMatrices};
use crate::error::ModelError;
use crate::field::Field;
use crate::integration::integrator::{Advance, Continuation, Integrator};
use crate::integration::pace::{Bounds, Pace};
use crate::integration::settings::Settings;
use crate::integration::statistics::Counts;
use crate::integration::typical::transit_time;
use crate::muscle_dae::MuscleDae;
use crate::signal::schedule::Schedule;
use crate::start::Consistent;

/// Radau IIA with a stop time at the end of the run.
pub struct RadauIntegrator<P: Problem, M = SparseDirectSolver> {
    solver: RadauSolver<P, M>,
    pace: Pace,
    /// Counts up to the last restart.
    before: Counts,
}

impl RadauIntegrator<MuscleDae, SystemMatrices<MuscleDae>> {
    /// Starts a muscle at time `t` from a state with consistent derivatives.
    ///
    /// # Errors
    /// Returns [`ModelError::OnlyBdf`] for settings that only BDF supports, and [`ModelError::Radau`] if a setting of
    /// Radau IIA is invalid.
    pub fn starting_at(
        dae: MuscleDae,
        settings: &Settings,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        settings.expect_no_bdf_settings()?;
        let relaxes = dae.layout().range(Field::InternalStress).is_some();
        let test = relaxes.then(|| ErrorTest::of_muscle(&dae, settings));
        let options = options(&dae, settings);
        let times = [t, settings.t_end];
        Self::coupled_at(dae, test, options, settings.linear_solver, times, y, y_dot)
    }
}

impl<P: Problem, M: myovib_dae::LinearSolver<P>> RadauIntegrator<P, M> {
    /// Creates the integrator of `problem` for the interval from `t` to `t_end`, starting from consistent values.
    ///
    /// # Errors
    /// Returns [`ModelError::Radau`] if an option of Radau IIA is invalid.
    pub fn new(
        problem: P,
        matrices: M,
        options: RadauOptions,
        (t, t_end): (f64, f64),
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let solver = builder(problem, options, t_end).build_with(matrices, t, y, y_dot)?;
        Ok(Self::of(solver, t_end))
    }

    /// Creates the integrator with error weights as a function of y.
    ///
    /// # Errors
    /// Returns [`ModelError::Radau`] if an option of Radau IIA is invalid.
    pub(crate) fn with_weights(
        problem: P,
        matrices: M,
        options: RadauOptions,
        (t, t_end): (f64, f64),
        (y, y_dot): (&[f64], &[f64]),
        mut weights: impl FnMut(&[f64], &mut [f64]) + Send + 'static,
    ) -> Result<Self, ModelError> {
        let solver = builder(problem, options, t_end)
            .error_weights(move |_, y, out| {
                weights(y, out);
                Ok(())
            })
            .build_with(matrices, t, y, y_dot)?;
        Ok(Self::of(solver, t_end))
    }

    fn of(solver: RadauSolver<P, M>, t_end: f64) -> Self {
        Self { solver, pace: Pace::new(Schedule::default(), t_end), before: Counts::default() }
    }

    /// Creates the integrator like [`new`](Self::new), with internal variables in addition to the unknowns.
    pub(crate) fn with_internal_variables(
        problem: P,
        matrices: M,
        options: RadauOptions,
        (t, t_end): (f64, f64),
        (y, y_dot): (&[f64], &[f64]),
        variables: InternalVariables,
    ) -> Result<Self, ModelError>
    where
        P: InternalVariableProblem,
    {
        let builder = builder(problem, options, t_end).internal_variables(variables);
        let solver = builder.build_with(matrices, t, y, y_dot)?;
        Ok(Self::of(solver, t_end))
    }

    /// Returns the time just after a jump, if there is a jump at the current time.
    pub(crate) fn after_jump(&self) -> Option<f64> {
        self.pace.after_jump(self.solver.t())
    }

    /// Sets the `schedule` of the excitation.
    pub(crate) fn with_schedule(self, schedule: Schedule) -> Self {
        let pace = Pace::new(schedule, self.pace.t_end());
        Self { pace, ..self }
    }

    /// Returns the Radau IIA solver.
    pub fn solver(&self) -> &RadauSolver<P, M> {
        &self.solver
    }

    pub(crate) fn solver_mut(&mut self) -> &mut RadauSolver<P, M> {
        &mut self.solver
    }
}

/// Ratio of Newton's tolerance to the tolerance for the solution if the steps are fixed. With fixed steps, the end
/// state should be a smooth function of the start.
pub const FIXED_STEP_ERROR: f64 = 1e-2;

/// Returns the control of the step size for a constant step, or for adaptive steps if `fixed_step` is `None`.
pub(crate) fn step_size(fixed_step: Option<f64>) -> StepSize {
    fixed_step.map_or(StepSize::Adaptive, StepSize::Fixed)
}

fn builder<P: Problem>(problem: P, options: RadauOptions, t_end: f64) -> RadauBuilder<P> {
    let relative = options.tolerances.relative();
    let newton_tolerance = match (options.newton_tolerance, options.step_size) {
        (None, StepSize::Fixed(_)) => {
            let error = FIXED_STEP_ERROR.max(10.0 * f64::EPSILON / relative);
            Some(error / options.internal_factor(relative))
        }
        (requested, _) => requested,
    };
    RadauSolver::builder(problem).options(RadauOptions {
        newton_tolerance,
        stop_time: Some(t_end),
        // Runs read samples from dense output, but its error does not limit the steps yet.
        dense_output: false,
        // The user of a scene provides no Jacobian.
        check_jacobian_at_stop: false,
        ..options
    })
}

/// Newton's tolerance for undamped compressible bodies, as a fraction of the tolerance for the estimate or for the
/// solution, whichever is smaller.
///
/// The error estimate of the next step amplifies the remaining error of Newton's method in undamped vibrations of the
/// volume. With the default, which is three times as large, runs with tolerances of 1e-2 and 1e-4 needed up to ten
/// times as many steps as runs with 1e-6. Below 1e-5, the default suffices.
const UNDAMPED_NEWTON_ERROR: f64 = 1e-2;

/// Returns the options of Radau IIA for a muscle with `settings`.
///
/// With a Jacobian evaluated at rest, Newton's method has a contraction rate of a few percent throughout the paper's
/// load, and a factorization costs as much as ten solves. Therefore, the Jacobian is kept up to a contraction rate of
/// 0.1, and the step size is kept until it may double. On row 1 of Table 2, this requires a sixth of the
/// factorizations that RADAU5's values (0.001 and 1.2) require, but 10 % more steps.
pub fn options(dae: &MuscleDae, settings: &Settings) -> RadauOptions {
    let layout = dae.layout();
    let options = settings.steps.in_radau(RadauOptions {
        tolerances: settings.tolerances(layout),
        suppressed: Suppressed::Components(settings.excluded(layout)),
        stages: settings.integrator.stages().unwrap_or(3),
        step_size: step_size(settings.fixed_step),
        time_scale: transit_time(dae.muscle()),
        jacobian_reuse: 0.1,
        step_window: (1.0, 2.0),
        sparse: settings.sparse_options(),
        ..RadauOptions::default()
    });
    let (muscle, relative) = (dae.muscle(), options.tolerances.relative());
    let parameters = &muscle.parameters;
    let is_damped = parameters.is_damped() || !muscle.solid.added_stresses().is_empty();
    let amplifies_errors =
        !is_damped && !parameters.is_incompressible() && muscle.solid.has_inertia();
    let is_loose = relative >= 1e-5 && options.step_size == StepSize::Adaptive;
    let newton_tolerance = (amplifies_errors && is_loose)
        .then(|| UNDAMPED_NEWTON_ERROR / options.internal_factor(relative).max(1.0));
    RadauOptions { newton_tolerance, ..options }
}

impl<P: Consistent, M: myovib_dae::LinearSolver<P>> Integrator<P> for RadauIntegrator<P, M> {
    fn pass_jump(&mut self) -> Result<(), ModelError> {
        let Some(after) = self.after_jump() else {
            return Ok(());
        };
        let y = self.solver.y().to_vec();
        let [y, y_dot] = self.solver.problem_mut().consistent(after, &y)?;
        self.before = self.counts();
        Ok(self.solver.reinit(after, &y, &y_dot)?)
    }

    fn advance(&mut self) -> Result<Advance, ModelError> {
        self.pass_jump()?;
        let Bounds { t_out, stop_time, is_resolved } =
            self.pace.bounds(self.solver.t(), &self.solver.statistics());
        self.solver.set_stop_time(stop_time)?;
        self.solver.detect_inputs(!is_resolved);
        Ok(Advance::of(self.solver.step(t_out)?, self.pace.t_end()))
    }

    fn time(&self) -> f64 {
        self.solver.t()
    }

    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError> {
        Ok(self.solver.dense_output(t, derivative as usize, out)?)
    }

    fn counts(&self) -> Counts {
        self.before.followed_by(Counts::from(self.solver.statistics()))
    }

    fn save(&self) -> Option<Continuation> {
        Some(Continuation {
            radau: self.solver.save(),
            shortened: self.pace.shortened(),
            before: self.before,
            chains: None,
        })
    }

    fn restore(&mut self, continuation: &Continuation) -> Result<(), ModelError> {
        self.solver.restore(&continuation.radau)?;
        self.pace.restore(continuation.shortened);
        self.before = continuation.before;
        Ok(())
    }

    fn problem(&self) -> &P {
        self.solver.problem()
    }

    fn problem_mut(&mut self) -> &mut P {
        self.solver.problem_mut()
    }
}

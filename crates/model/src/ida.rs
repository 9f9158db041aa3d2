//! IDAS as an [`Integrator`] of a model.

use sundials_wrap as wrap;
use sundials_wrap::klu::KluOptions;
use sundials_wrap::{
    ConsistencyMode, DaeProblem, IdaBuilder, IdaOptions, IdaSolver, Suppressed, Tolerances,
};

use crate::coupling::{Body, CoupledDae, ErrorTest, FeedbackDae};
use crate::error::ModelError;
use crate::first_step::look_ahead;
use crate::integrator::{Advance, Counts, Integrator};
use crate::linear::{CondensedSolver, CoupledSolver};
use crate::muscle_dae::MuscleDae;
use crate::settings::{LinearSolver, MultiplierWeights, Settings};
use crate::statistics::StopReason;
use crate::step_weights::{StepSize, StepWeights};

/// IDAS in one-step mode with a stop time at the end.
pub struct IdaIntegrator<P: DaeProblem> {
    solver: IdaSolver<P>,
    t_end: f64,
    /// The shortest time in which the system changes of itself, s.
    time_scale: Option<f64>,
    /// Whether a step was taken since the start or restart.
    begun: bool,
    /// Where error weights that follow the step read its size.
    step_size: StepSize,
}

impl IdaIntegrator<MuscleDae> {
    /// Starts a muscle at rest at t = 0: all unknowns and their derivatives zero, which is
    /// consistent for loads and prescribed displacements that start from zero.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for settings IDAS does not take.
    pub fn from_rest(dae: MuscleDae, settings: &Settings) -> Result<Self, ModelError> {
        let zero = vec![0.0; dae.n_unknowns()];
        Self::starting_at(dae, settings, 0.0, &zero, &zero)
    }

    /// Starts a muscle, at order 1, at time `t` from a state with consistent derivatives.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for settings IDAS does not take.
    pub fn starting_at(
        dae: MuscleDae,
        settings: &Settings,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let options = options(&dae, settings);
        let condensed = match settings.linear_solver {
            LinearSolver::Condensed => Some(CondensedSolver::new(&dae, options.klu)?),
            LinearSolver::Full => None,
        };
        let step_size = StepSize::default();
        let time_scale = dae.muscle().time_scale();
        let scaled = settings.multiplier_weights == MultiplierWeights::StepScaled;
        let weights = scaled.then(|| StepWeights::new(&dae, settings, step_size.clone()));
        let mut builder = builder(dae, options, settings.t_end);
        if let Some(solver) = condensed {
            builder = builder.structured_solver(solver);
        }
        if let Some(weights) = weights {
            builder = builder.error_weights(move |_, y, out| {
                weights.write(y, out);
                Ok(())
            });
        }
        Ok(Self {
            solver: builder.build(t, y, y_dot)?,
            t_end: settings.t_end,
            time_scale,
            begun: false,
            step_size,
        })
    }
}

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
        let (y_dot, imbalance) = dae.derivatives_at(0.0, y)?;
        let times = [0.0, t_end];
        let mut integrator =
            Self::coupled_at(dae, error_test, options, linear_solver, times, y, &y_dot)?;
        if imbalance > 0.0 {
            let mode = ConsistencyMode::AlgebraicAndDerivatives;
            let t_first = integrator.look_ahead();
            integrator.solver.correct_initial_values(mode, t_first)?;
        }
        Ok(integrator)
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
        let time_scale = dae.time_scale();
        let mut builder = tested(dae, error_test, options, t_end);
        if let Some(solver) = condensed {
            builder = builder.structured_solver(solver);
        }
        Ok(Self {
            solver: builder.build(t, y, y_dot)?,
            t_end,
            time_scale,
            begun: false,
            step_size: StepSize::default(),
        })
    }
}

impl IdaIntegrator<FeedbackDae> {
    /// Starts a muscle with feedback from a state with consistent derivatives, over the times
    /// `[start, end]`. Its Newton matrices are factorised as a whole.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for options IDAS does not take.
    pub fn feedback_at(
        dae: FeedbackDae,
        error_test: ErrorTest,
        options: IdaOptions,
        [t, t_end]: [f64; 2],
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let time_scale = dae.one_way().time_scale();
        Ok(Self {
            solver: tested(dae, error_test, options, t_end).build(t, y, y_dot)?,
            t_end,
            time_scale,
            begun: false,
            step_size: StepSize::default(),
        })
    }
}

impl<P: DaeProblem> IdaIntegrator<P> {
    /// Starts `problem` at t = 0 from consistent values.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for options IDAS does not take.
    pub fn new(
        problem: P,
        options: IdaOptions,
        t_end: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        let solver = builder(problem, options, t_end).build(0.0, y, y_dot)?;
        Ok(Self {
            solver,
            t_end,
            time_scale: None,
            begun: false,
            step_size: StepSize::default(),
        })
    }

    /// t_out of the first step.
    fn look_ahead(&self) -> f64 {
        look_ahead(self.solver.t(), self.t_end, self.time_scale)
    }

    /// The problem with y and ẏ at the time reached.
    pub fn into_state(self) -> (P, Vec<f64>, Vec<f64>) {
        let (y, y_dot) = (self.solver.y().to_vec(), self.solver.y_dot().to_vec());
        (self.solver.into_problem(), y, y_dot)
    }

    /// Starts again, at order 1, at time `t` from a state with consistent derivatives; counts begin
    /// anew.
    ///
    /// # Errors
    /// [`ModelError::Integrator`] for values that are not finite.
    pub fn restart(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Result<(), ModelError> {
        self.begun = false;
        Ok(self.solver.reinit(t, y, y_dot, &[])?)
    }

    /// The solver itself.
    pub fn solver(&self) -> &IdaSolver<P> {
        &self.solver
    }
}

fn builder<P: DaeProblem>(problem: P, options: IdaOptions, t_end: f64) -> IdaBuilder<P> {
    IdaSolver::builder(problem).options(IdaOptions {
        stop_time: Some(t_end),
        ..options
    })
}

/// A system of parts, each of which the error test looks at in its own way.
fn tested<P: DaeProblem>(
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

/// The options of IDAS for a muscle with `settings`.
pub fn options(dae: &MuscleDae, settings: &Settings) -> IdaOptions {
    let layout = dae.layout();
    IdaOptions {
        tolerances: Tolerances::vector(
            settings.relative_tolerance,
            layout.fill(|field| settings.absolute_tolerances.of(field)),
        ),
        suppressed: Suppressed::Components(
            layout.fill(|field| settings.suppressed.contains(&field)),
        ),
        max_order: usize::from(settings.max_order),
        delta_cj: settings.delta_cj,
        initial_step: settings.initial_step,
        max_step: settings.max_step,
        klu: KluOptions {
            ordering: settings.ordering,
            btf: settings.btf,
            ..KluOptions::default()
        },
        ..IdaOptions::default()
    }
}

impl<P: DaeProblem> Integrator<P> for IdaIntegrator<P> {
    fn advance(&mut self) -> Result<Advance, ModelError> {
        self.step_size.set(self.solver.current_step());
        let t_out = if self.begun {
            self.t_end
        } else {
            self.look_ahead()
        };
        self.begun = true;
        Ok(advance(self.solver.step(t_out)?, self.t_end))
    }

    fn time(&self) -> f64 {
        self.solver.t()
    }

    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError> {
        Ok(self.solver.dense_output(t, derivative as usize, out)?)
    }

    fn counts(&self) -> Counts {
        Counts::from(self.solver.stats())
    }

    fn problem(&self) -> &P {
        self.solver.problem()
    }

    fn problem_mut(&mut self) -> &mut P {
        self.solver.problem_mut()
    }
}

/// What a step of a solver came to, for the run driver.
pub(crate) fn advance(outcome: wrap::Outcome, t_end: f64) -> Advance {
    match outcome {
        wrap::Outcome::Stopped(stop) => {
            let worst: Vec<_> = stop
                .worst_components
                .iter()
                .take(3)
                .map(|w| format!("{} ({:.1})", w.name, w.weighted_error))
                .collect();
            let mut message = stop.to_string();
            if !worst.is_empty() {
                message += "; largest weighted errors: ";
                message += &worst.join(", ");
            }
            Advance::Stopped {
                reason: reason(stop.reason),
                message,
            }
        }
        outcome if outcome.t() >= t_end => Advance::Finished,
        _ => Advance::Stepped,
    }
}

impl From<wrap::Stats> for Counts {
    fn from(stats: wrap::Stats) -> Self {
        Self {
            steps: stats.steps,
            error_test_failures: stats.error_test_failures,
            step_solve_failures: stats.step_solve_failures,
            newton_failures: stats.newton_failures,
            newton_iterations: stats.newton_iterations,
            residual_evaluations: stats.residual_evaluations,
            jacobian_evaluations: stats.jacobian_evaluations,
            linear_setups: stats.linear_setups,
            last_order: stats.last_order as u32,
            last_step: stats.last_step,
            radau_work: None,
        }
    }
}

/// The wrapper's reasons under the names all integrators share.
fn reason(reason: wrap::StopReason) -> StopReason {
    use wrap::StopReason as Ida;
    match reason {
        Ida::ErrorTestFailures | Ida::ToleranceTooTight | Ida::ErrorWeightsFailed => {
            StopReason::ErrorTestFailures
        }
        Ida::ConvergenceFailures | Ida::ConstraintsViolated => StopReason::ConvergenceFailures,
        Ida::StepTooSmall => StopReason::StepTooSmall,
        Ida::LinearSetupFailed | Ida::LinearSolveFailed => StopReason::LinearSetupFailed,
        Ida::MaxSteps => StopReason::MaxSteps,
        Ida::ResidualFailed | Ida::RootFunctionFailed | Ida::QuadratureFailed | Ida::Other => {
            StopReason::ResidualFailed
        }
    }
}

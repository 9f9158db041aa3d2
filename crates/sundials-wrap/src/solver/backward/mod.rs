//! Backward problems of a solver: creation, restart, correction of initial values, and integration. The module
//! [`evaluation`] contains the functions that IDAS calls during the integration.

mod evaluation;

use super::builder::validate_quadrature_tolerances;
use super::linear::WholeLu;
use super::registered::{RegisteredProblem, Repeating};
use super::{IdaSolver, call_error, codes};
use crate::adjoint::{
    At, Backward, BackwardOptions, BackwardProblem, BackwardRun, Checkpoints, ForwardState,
    Interpolation,
};
use crate::error::Error;
use crate::ffi::call::CallFailed;
use crate::ffi::ida::Counter;
use crate::options::{IdaOptions, differential, expect_order};
use myovib_dae::checks::{
    expect, expect_count, expect_finite_value, expect_length, expect_tolerances, expect_vector,
};
use myovib_dae::{IntegratorError, Jacobian, Outcome, Problem, Statistics, Stop, kinds_at};

/// Data for the backward problems of a solver with checkpoints.
pub(super) struct ForwardRun {
    every: usize,
    /// Size of the first step; 0 if it is estimated. IDAS discards the size, so it is set again before a run is
    /// repeated.
    initial_step: f64,
    runs: Vec<BackwardRun>,
    /// Counters of the forward run, saved at the start of the first backward integration because IDAS then repeats parts
    /// of the run.
    pub(super) left: Option<Statistics>,
}

impl BackwardOptions {
    fn validate(&self, n: usize, n_quadratures: usize) -> Result<(), IntegratorError> {
        expect_tolerances(&self.tolerances, n)?;
        if let Some((relative, absolute)) = self.quadrature_tolerances {
            if n_quadratures == 0 {
                return Err(IntegratorError::NoQuadrature);
            }
            validate_quadrature_tolerances(relative, absolute)?;
        }
        expect_count("max_steps of a backward problem", self.max_steps)?;
        expect_order("max_order of a backward problem", self.max_order)
    }
}

impl<P: Problem> IdaSolver<P> {
    /// Enables checkpoints. Fails if a requested feature would not be repeated when steps of the run are repeated.
    pub(super) fn attach_checkpoints(
        &mut self,
        checkpoints: Checkpoints,
        options: &IdaOptions,
    ) -> Result<(), Error> {
        expect_count("steps between checkpoints", checkpoints.every)?;
        let index = self.functions().problem.indices();
        let index = index.into_iter().flatten().max().unwrap_or(0);
        if index > 2 {
            return Err(Error::NoAdjoint { index });
        }
        if self.functions().n_roots > 0 {
            return Err(Error::NotWithCheckpoints { what: "roots" });
        }
        if options.stop_time.is_some() {
            return Err(Error::NotWithCheckpoints { what: "a stop time" });
        }
        if options.check_within_steps {
            return Err(Error::NotWithCheckpoints { what: "a check within steps" });
        }
        let hermite = checkpoints.interpolation == Interpolation::Hermite;
        self.call(|ida| ida.init_adjoint(checkpoints.every, hermite))?;
        self.forward_run = Some(ForwardRun {
            every: checkpoints.every,
            initial_step: options.initial_step.unwrap_or(0.0),
            runs: Vec::new(),
            left: None,
        });
        Ok(())
    }

    /// Fails if the forward run cannot continue.
    pub(super) fn expect_not_left(&self) -> Result<(), Error> {
        match &self.forward_run {
            Some(ForwardRun { left: Some(_), .. }) => Err(Error::ForwardRunLeft),
            _ => Ok(()),
        }
    }

    /// Ends the backward integration so that a new forward run can start.
    pub(super) fn forget_backward_runs(&mut self) -> Result<(), Error> {
        self.functions_mut().repeating = Repeating::default();
        let Some(forward_run) = &mut self.forward_run else {
            return Ok(());
        };
        forward_run.left = None;
        let step = forward_run.initial_step;
        self.call(|ida| ida.set_initial_step(step))
    }

    /// Returns the solution at [`t`](IdaSolver::t), with its sensitivities.
    ///
    /// # Errors
    /// Returns [`Error::ForwardRunLeft`] after a backward integration, and the errors of
    /// [`sensitivity_dense_output`](IdaSolver::sensitivity_dense_output).
    pub fn forward_state(&mut self) -> Result<ForwardState, Error> {
        self.expect_not_left()?;
        let mut state = ForwardState {
            t: self.t,
            y: self.y().to_vec(),
            y_dot: self.y_dot().to_vec(),
            s: Vec::new(),
        };
        for j in 0..self.n_parameters() {
            let mut pair = [vec![0.0; self.n], vec![0.0; self.n]];
            for (derivative, values) in pair.iter_mut().enumerate() {
                self.sensitivity_dense_output(j, state.t, derivative, values)?;
            }
            state.s.push(pair);
        }
        Ok(state)
    }

    /// Adds a backward problem that starts at `at`, a [state](Self::forward_state) of the forward run. `start` contains
    /// the values of λ and λ̇; the quadratures start at zero. All backward problems are integrated together.
    ///
    /// # Errors
    /// Returns [`Error::NoCheckpoints`] if the solver does not store checkpoints; [`IntegratorError::WrongLength`],
    /// [`IntegratorError::NotFinite`] or [`IntegratorError::InvalidOption`] if values are invalid; and
    /// [`Error::Callback`] if the problem fails at the start.
    pub fn add_backward(
        &mut self,
        problem: impl BackwardProblem<P> + Send + 'static,
        options: &BackwardOptions,
        at: &ForwardState,
        start: [&[f64]; 2],
    ) -> Result<Backward, Error> {
        self.expect_state_of_run(at)?;
        let (n, n_quadratures) = (problem.n_unknowns(), problem.n_quadratures());
        expect_start(n, start)?;
        options.validate(n, n_quadratures)?;
        let pattern = problem.jacobian_pattern();
        expect_length("rows of a backward Jacobian", n, pattern.minor_dim())?;
        expect_length("columns of a backward Jacobian", n, pattern.major_dim())?;
        if pattern.nnz() == 0 {
            let (n_unknowns, n_entries) = (n, 0);
            return Err(Error::Empty { n_unknowns, n_entries });
        }
        let mut registered = RegisteredProblem {
            problem: Box::new(problem),
            lu: WholeLu::new(Jacobian::with_pattern(pattern), self.sparse)?,
            tolerances: options.tolerances.clone(),
            weights: vec![1.0; n],
            state: at.clone(),
        };
        let mut problem = At {
            problem: registered.problem.as_mut(),
            forward: &mut self.functions_mut().problem,
            state: at,
        };
        let kinds = kinds_at(&mut problem, at.t, start[0], start[1]);
        let kinds = kinds.map_err(|error| Error::Callback {
            function: "Jacobian of a backward problem",
            t: at.t,
            source: error.into(),
        })?;
        let id = differential(&kinds);
        self.call(|ida| ida.add_backward(at.t, start, (options, &id, n_quadratures)))?;
        self.functions_mut().backward.push(registered);
        let run = BackwardRun {
            t: at.t,
            values: start[0].to_vec(),
            rates: start[1].to_vec(),
            quadratures: vec![0.0; n_quadratures],
            statistics: Statistics::default(),
        };
        let runs = self.runs_mut()?;
        runs.push(run);
        Ok(Backward(runs.len() - 1))
    }

    /// Restarts a backward problem at `at`, as [`add_backward`](Self::add_backward) does.
    ///
    /// # Errors
    /// Returns the errors of [`add_backward`](Self::add_backward), and [`Error::NoBackward`].
    pub fn restart_backward(
        &mut self,
        backward: Backward,
        at: &ForwardState,
        start: [&[f64]; 2],
    ) -> Result<(), Error> {
        self.expect_state_of_run(at)?;
        expect_start(self.backward(backward)?.values.len(), start)?;
        self.call(|ida| ida.restart_backward(backward.0, at.t, start))?;
        self.functions_mut().backward[backward.0].state = at.clone();
        let run = &mut self.runs_mut()?[backward.0];
        run.t = at.t;
        run.values.copy_from_slice(start[0]);
        run.rates.copy_from_slice(start[1]);
        run.quadratures.fill(0.0);
        run.statistics = Statistics::default();
        Ok(())
    }

    /// Corrects the algebraic components of λ and the differential components of λ̇ at the start of a backward problem,
    /// before it is integrated. `t_first` is a later output time, which determines the time scale.
    ///
    /// # Errors
    /// Returns the errors of [`correct_initial_values`](IdaSolver::correct_initial_values), and [`Error::NoBackward`].
    pub fn correct_backward(&mut self, backward: Backward, t_first: f64) -> Result<(), Error> {
        expect_finite_value("t_first", t_first)?;
        let run = self.backward(backward)?;
        let t = run.t;
        if run.statistics.steps > 0 {
            return Err(IntegratorError::AfterTheStart { t }.into());
        }
        let functions = self.functions_mut();
        functions.failures = Default::default();
        let state = functions.backward[backward.0].state.clone();
        let which = backward.0;
        let result = self.ida.correct_backward(which, t_first, &state.view());
        self.resume_panic();
        result.map_err(|failed| self.inconsistent(failed, t))?;
        let [values, rates] =
            self.call(|ida| ida.backward_start(which).map(|start| start.map(<[f64]>::to_vec)))?;
        let run = &mut self.runs_mut()?[which];
        (run.values, run.rates) = (values, rates);
        Ok(())
    }

    /// Integrates all backward problems to `t_out`, which is before their current times. The forward run cannot
    /// continue afterward; [`reinit`](IdaSolver::reinit) starts a new run.
    ///
    /// # Errors
    /// Returns [`Error::NoBackward`], [`IntegratorError::TimeBehind`] or other errors for misuse, and the errors of
    /// [`step`](IdaSolver::step).
    pub fn integrate_back_to(&mut self, t_out: f64) -> Result<Outcome, Error> {
        expect_finite_value("t_out", t_out)?;
        let none = Error::NoBackward { number: 0, of: 0 };
        let forward_run = self.forward_run.as_ref().ok_or(Error::NoCheckpoints)?;
        let (every, n_runs) = (forward_run.every, forward_run.runs.len());
        let t = forward_run.runs.iter().map(|run| run.t).reduce(f64::min);
        let t = t.ok_or(none)?;
        let within = t_out >= self.t0;
        expect("t_out", t_out, within, "at or after the start of the forward run")?;
        if t_out >= t {
            return Err(IntegratorError::TimeBehind { t_out, t }.into());
        }
        let statistics = self.statistics();
        if let Some(forward_run) = &mut self.forward_run {
            forward_run.left.get_or_insert(statistics);
        }
        let most = Some(every * (1 + self.n_parameters()));
        let functions = self.functions_mut();
        functions.failures = Default::default();
        functions.repeating = Repeating { most, weights: 0 };
        let code = self.call(|ida| ida.solve_backward(t_out));
        self.resume_panic();
        let code = code?;
        if code < 0 {
            return self.gave_up_backward(code, t);
        }
        for which in 0..n_runs {
            self.take_backward_values(which, t_out)?;
        }
        Ok(Outcome::Reached { t: t_out })
    }

    fn take_backward_values(&mut self, which: usize, t: f64) -> Result<(), Error> {
        let [values, rates, quadratures] =
            self.call(|ida| Ok(ida.backward_values(which)?.map(<[f64]>::to_vec)))?;
        let statistics = self.backward_statistics(which)?;
        self.runs_mut()?[which] = BackwardRun { t, values, rates, quadratures, statistics };
        Ok(())
    }

    fn backward_statistics(&mut self, which: usize) -> Result<Statistics, Error> {
        let mut statistics = Statistics::default();
        for (counter, place) in [
            (Counter::Steps, &mut statistics.steps),
            (Counter::ErrorTestFailures, &mut statistics.error_test_failures),
            (Counter::NewtonFailures, &mut statistics.newton_failures),
            (Counter::NewtonIterations, &mut statistics.newton_iterations),
            (Counter::ResidualEvaluations, &mut statistics.residual_evaluations),
            (Counter::LinearSetups, &mut statistics.linear_setups),
            (Counter::JacobianEvaluations, &mut statistics.jacobian_evaluations),
        ] {
            *place = self.call(|ida| ida.backward_counter(which, counter))?;
        }
        Ok(statistics)
    }

    fn gave_up_backward(&mut self, code: i32, t: f64) -> Result<Outcome, Error> {
        let failures = &mut self.functions_mut().failures;
        if let Some(fatal) = failures.fatal.take() {
            return Err(fatal);
        }
        let culprit = failures.culprit();
        let message = failures.take_message();
        let Some(reason) = codes::stop_reason(code) else {
            return Err(call_error(CallFailed::new("IDASolveB", code), message));
        };
        let message = format!("{message} ({})", codes::name(code));
        let (reason, statistics) = (culprit.unwrap_or(reason), self.statistics());
        let stop = Stop::new(reason, message, t, statistics, Vec::new());
        Ok(Outcome::Stopped(Box::new(stop)))
    }

    /// Returns the state of a backward problem.
    ///
    /// # Errors
    /// Returns [`Error::NoBackward`] if the handle belongs to another solver.
    pub fn backward(&self, backward: Backward) -> Result<&BackwardRun, Error> {
        let runs = self.forward_run.as_ref().map_or(&[][..], |forward_run| &forward_run.runs);
        let (number, of) = (backward.0, runs.len());
        runs.get(number).ok_or(Error::NoBackward { number, of })
    }

    fn runs_mut(&mut self) -> Result<&mut Vec<BackwardRun>, Error> {
        let forward_run = self.forward_run.as_mut().ok_or(Error::NoCheckpoints)?;
        Ok(&mut forward_run.runs)
    }

    /// Checks that the state belongs to the forward run of this solver and to a time that the run has passed.
    fn expect_state_of_run(&self, at: &ForwardState) -> Result<(), Error> {
        if self.forward_run.is_none() {
            return Err(Error::NoCheckpoints);
        }
        expect_vector("y of the forward state", self.n, &at.y)?;
        expect_vector("y_dot of the forward state", self.n, &at.y_dot)?;
        expect_length("sensitivities of the forward state", self.n_parameters(), at.s.len())?;
        for values in at.s.iter().flatten() {
            expect_vector("a sensitivity of the forward state", self.n, values)?;
        }
        let passed = at.t > self.t0 && at.t <= self.t;
        Ok(expect("t of the forward state", at.t, passed, "a time of the forward run")?)
    }
}

fn expect_start(n: usize, [values, rates]: [&[f64]; 2]) -> Result<(), IntegratorError> {
    expect_vector("start of a backward problem", n, values)?;
    expect_vector("slope of a backward problem", n, rates)
}

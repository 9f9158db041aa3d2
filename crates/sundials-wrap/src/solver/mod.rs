//! The integrator: [`IdaSolver`] owns a problem and integrates it with IDAS.

mod backward;
mod builder;
mod callbacks;
mod codes;
mod dense;
mod initial_values;
mod linear;
mod newton;
mod registered;
mod sensitivity;
mod state;
mod within;
mod zeros;

use std::panic::resume_unwind;

use sundials_sys as sys;

use crate::error::Error;
use crate::ffi::call::CallFailed;
use crate::ffi::ida::{Counter, Ida, Task};
use myovib_dae::checks::{expect, expect_finite_value, expect_state, expect_vector};
use myovib_dae::{
    InconsistentStart, IntegratorError, Linearization, Outcome, Problem, Stop, StopReason,
    VariableKind, WorstComponent, check_start, integrator_by_own_methods,
};

use crate::options::IdaOptions;
use myovib_sparse::SparseOptions;

pub use builder::IdaBuilder;
use callbacks::{Repetitions, UserFunctions};
pub use sensitivity::{SensitivityMethod, SensitivityOptions, SensitivityStatistics};

/// Number of steps after which the solver checks whether t has changed.
const PATIENCE: usize = 500;

/// An integration of a [`Problem`] by the variable-order, variable-step BDF of IDAS.
///
/// The solver is `Send` if the problem is `Send`; only one thread at a time may use it. A panic in a function of the
/// problem is caught, and resumed after IDAS has returned.
///
/// # Examples
/// See the [front page of the crate](crate).
pub struct IdaSolver<P: Problem> {
    ida: Ida<UserFunctions<P>>,
    kinds: Vec<VariableKind>,
    /// Vector passed to IDAS for the error test, if components are excluded from the test.
    suppressed: Option<Vec<f64>>,
    t0: f64,
    /// Initial values y0 and ẏ0, before the first step.
    start: [Vec<f64>; 2],
    /// Result of the consistency check, reported by the first step.
    consistent: Result<(), InconsistentStart>,
    /// Time of y and ẏ.
    t: f64,
    n: usize,
    min_step: f64,
    /// Whether the Jacobian is compared with difference quotients after a stop.
    checks_jacobian: bool,
    /// Settings for the estimate of the first step size, if IDAS does not choose it.
    first_step_of: Option<IdaOptions>,
    max_steps: Option<usize>,
    /// Number of steps and time at the last check for which t had increased.
    mark: (u64, f64),
    /// Last recoverable failure of a user function since the time in `mark`, including failures in earlier calls.
    refusal: Option<String>,
    /// Time at which a step must end; `None` after it is reached.
    stop_time: Option<f64>,
    /// Whether IDAS still has a stop time from before the start. IDAS cannot discard a stop time.
    stop_time_lingers: bool,
    /// Number of residual evaluations for difference quotients before the last start.
    differences_before: u64,
    /// Settings of the linear solvers of backward problems.
    sparse: SparseOptions,
    /// Backward problems, if checkpoints are stored.
    forward_run: Option<backward::ForwardRun>,
}

impl<P: Problem> IdaSolver<P> {
    /// Takes one step toward `t_out`; IDAS determines the step size.
    ///
    /// `t_out` determines the direction of integration. At the first step, it also provides the time scale for the
    /// estimate of the step size. The step may end beyond `t_out`. This method does not allocate memory, except when a
    /// root is found or the integration stops.
    ///
    /// # Errors
    /// Returns [`IntegratorError::TimeBehind`] or another error for misuse, and [`Error::Callback`] if the problem
    /// returns a fatal error.
    pub fn step(&mut self, t_out: f64) -> Result<Outcome, Error> {
        self.advance(t_out, Task::OneStep)
    }

    /// Integrates to `t_out`, unless a root or the stop time comes first. At `t_out`, y and ẏ are interpolated.
    ///
    /// # Errors
    /// Returns the same errors as [`step`](IdaSolver::step).
    pub fn integrate_to(&mut self, t_out: f64) -> Result<Outcome, Error> {
        self.advance(t_out, Task::Normal)
    }

    fn advance(&mut self, t_out: f64, task: Task) -> Result<Outcome, Error> {
        expect_finite_value("t_out", t_out)?;
        self.expect_not_left()?;
        // Before the first step, t_out determines the direction; afterward, the last step determines it.
        let direction = self.ida.last_step();
        if (t_out - self.t) * direction < 0.0 {
            return Err(IntegratorError::TimeBehind { t_out, t: self.t }.into());
        }
        if t_out == self.t && self.ida.counter(Counter::Steps) == 0 {
            // IDAS determines the direction and the scale of the first step from t_out.
            let is_allowed = matches!(task, Task::Normal);
            expect("t_out", t_out, is_allowed, "different from t at the first step")?;
            return Ok(Outcome::Reached { t: t_out });
        }
        self.consistent.map_err(IntegratorError::from)?;
        let direction = if direction == 0.0 { t_out - self.t } else { direction };
        self.functions_mut().zeros.direction = direction.signum();
        if self.stop_time_lingers {
            let out_of_reach = f64::MAX.copysign(t_out - self.t);
            self.call(|ida| ida.set_stop_time(out_of_reach))?;
            self.stop_time_lingers = false;
        }
        self.set_first_step(t_out)?;
        self.set_start_within(task)?;
        let before = std::mem::take(&mut self.functions_mut().failures);
        self.refusal = before.recoverable.or(self.refusal.take());
        let mut left = self.max_steps.unwrap_or(usize::MAX);
        let code = loop {
            let steps = left.min(PATIENCE);
            self.call(|ida| ida.set_max_steps(steps as i64))?;
            let (code, t) = self.ida.solve(t_out, task);
            if t.is_finite() {
                self.t = t;
            } else {
                self.restore_state();
            }
            if self.stands_still() && (code >= 0 || code == sys::IDA_TOO_MUCH_WORK) {
                return self.stood_still();
            }
            left -= steps;
            if code != sys::IDA_TOO_MUCH_WORK || left == 0 {
                break code;
            }
        };
        self.resume_panic();
        match code {
            // If the two times are equal, IDAS reports the output time, and would report the stop time in the next
            // call.
            sys::IDA_SUCCESS if task == Task::Normal && self.stop_time == Some(self.t) => {
                (self.stop_time, self.stop_time_lingers) = (None, true);
                Ok(Outcome::StopTime { t: self.t })
            }
            sys::IDA_SUCCESS => Ok(match task {
                Task::OneStep => Outcome::StepTaken { t: self.t },
                Task::Normal => Outcome::Reached { t: self.t },
            }),
            sys::IDA_TSTOP_RETURN => {
                self.stop_time = None;
                Ok(Outcome::StopTime { t: self.t })
            }
            sys::IDA_ROOT_RETURN => {
                let mut crossings = self.call(|ida| ida.root_info())?;
                let t = self.t;
                self.functions().zeros.keep_arrivals(t, &mut crossings);
                match crossings.iter().all(|crossing| *crossing == 0) {
                    true => self.advance(t_out, task),
                    false => Ok(Outcome::Root { t, crossings }),
                }
            }
            code => self.gave_up(code),
        }
    }

    /// Sets the size of the first step if components are excluded from the error test by their index.
    fn set_first_step(&mut self, t_out: f64) -> Result<(), Error> {
        let (Some(options), Some(tested)) = (&self.first_step_of, &self.suppressed) else {
            return Ok(());
        };
        if self.ida.counter(Counter::Steps) > 0 {
            return Ok(());
        }
        let ([y, y_dot], span) = (&self.start, t_out - self.t);
        let excluded: Vec<bool> = tested.iter().map(|tested| *tested == 0.0).collect();
        let step = options.first_step_of_index_2(y, y_dot, &excluded, span);
        // With a step of 0, IDAS estimates the step size.
        self.call(|ida| ida.set_initial_step(step.unwrap_or(0.0)))
    }

    /// Sets the start of the next step, which is needed for the search within the step. If a call takes several steps,
    /// only the start of the first step is known, so the steps are not searched.
    fn set_start_within(&mut self, task: Task) -> Result<(), Error> {
        let Some(mut within) = self.functions_mut().within.take() else {
            return Ok(());
        };
        let found = match task {
            Task::Normal => {
                within.forget_start();
                Ok(())
            }
            Task::OneStep if self.ida.counter(Counter::Steps) == 0 => {
                let [y, y_dot] = &self.start;
                within.start_at(self.t0, y, y_dot);
                Ok(())
            }
            Task::OneStep => {
                let t = self.ida.internal_time();
                self.call(|ida| {
                    within.write_start(t, |k, out| {
                        let values = ida.derivative(t, k)?;
                        out.clear();
                        out.extend_from_slice(values);
                        Ok(())
                    })
                })
            }
        };
        self.functions_mut().within = Some(within);
        found
    }

    /// Returns whether t does not advance, apart from rounding. IDAS would continue indefinitely.
    fn stands_still(&mut self) -> bool {
        let (steps, t) = (self.ida.counter(Counter::Steps), self.ida.internal_time());
        let (marked_steps, marked_t) = self.mark;
        if steps < marked_steps + PATIENCE as u64 {
            return false;
        }
        self.mark = (steps, t);
        let stands_still = is_unresolved(t - marked_t, t, steps - marked_steps);
        self.refusal.take_if(|_| !stands_still);
        stands_still
    }

    fn stood_still(&mut self) -> Result<Outcome, Error> {
        let mut cause = self.functions_mut().failures.take_message();
        if cause.is_empty() {
            cause = self.refusal.take().unwrap_or_default();
        }
        let mut message = format!("t did not change in {PATIENCE} steps");
        if !cause.is_empty() {
            message = format!("{message}; {cause}");
        }
        let worst = self.worst_components(false)?;
        Ok(self.stopped(StopReason::StepTooSmall, message, worst))
    }

    /// Returns the outcome of a call that cannot continue, with suggested remedies.
    fn stopped(
        &mut self,
        reason: StopReason,
        message: String,
        worst: Vec<WorstComponent>,
    ) -> Outcome {
        let mut stop = Stop::new(reason, message, self.t, self.statistics(), worst);
        if self.checks_jacobian {
            let (t, step) = (self.t, self.ida.current_step());
            let [y, y_dot] = [self.ida.y().to_vec(), self.ida.y_dot().to_vec()];
            let mut weights = vec![0.0; self.n];
            let UserFunctions { problem, weighing, .. } = self.functions_mut();
            if weighing.write(problem, &y, &mut weights).is_ok() {
                let at = Linearization { t, y: &y, y_dot: &y_dot, step, weights: &weights };
                stop = stop.examined(problem, &at);
            }
        }
        let highest = self.highest_index();
        Outcome::Stopped(Box::new(stop.advised(self.problem(), &self.kinds, highest)))
    }

    /// Returns the highest index that is supported with the present settings. The error test fails for variables of
    /// index 2, because their errors do not decrease with the step size.
    fn highest_index(&self) -> u8 {
        let Some((tested, indices)) = self.suppressed.as_ref().zip(self.problem().indices()) else {
            return 1;
        };
        let mut tests = tested.iter().zip(indices);
        if tests.any(|(tested, index)| index == 2 && *tested != 0.0) { 1 } else { 2 }
    }

    /// Restores y and ẏ at the current time if IDAS has stopped there without reporting a solution.
    fn restore_state(&mut self) {
        let [mut y, mut y_dot] = self.start.clone();
        let t = self.t;
        if self.ida.counter(Counter::Steps) > 0 {
            // The current time is in the last step. If IDAS has also discarded this step, only the initial values are
            // available.
            let restored = self.dense_output(t, 0, &mut y);
            if restored.and(self.dense_output(t, 1, &mut y_dot)).is_err() {
                [y, y_dot] = self.start.clone();
                self.t = self.t0;
            }
        }
        self.ida.set_state(&y, &y_dot);
    }

    fn gave_up(&mut self, code: i32) -> Result<Outcome, Error> {
        let failures = &mut self.functions_mut().failures;
        if let Some(fatal) = failures.fatal.take() {
            return Err(fatal);
        }
        if code == sys::IDA_ERR_FAIL {
            // The error test is applied at a state where all functions could be evaluated, so the problem has
            // recovered.
            failures.recoverable = None;
        }
        // IDAS reports a failed weight function as an illegal input.
        let weights_failed = code == sys::IDA_ILL_INPUT && failures.recoverable.is_some();
        let culprit = failures.culprit();
        let message = failures.take_message();
        let reason = match codes::stop_reason(code) {
            Some(reason) => reason,
            None if weights_failed => StopReason::ErrorWeightsFailed,
            None => return Err(call_error(CallFailed::new("IDASolve", code), message)),
        };
        let statistics = self.statistics();
        let step = statistics.current_step.abs();
        // IDAS treats a step as equal to the smallest step if they differ only by rounding.
        let at_limit = self.t + step == self.t || step <= self.min_step * (1.0 + 1e-6);
        let reason = match reason {
            StopReason::ErrorTestFailures | StopReason::ConvergenceFailures if at_limit => {
                StopReason::StepTooSmall
            }
            StopReason::ConvergenceFailures | StopReason::LinearSetupFailed => {
                culprit.unwrap_or(reason)
            }
            other => other,
        };
        let message = format!("{message} ({})", codes::name(code));
        let worst = self.worst_components(code == sys::IDA_ERR_FAIL)?;
        Ok(self.stopped(reason, message, worst))
    }

    /// Returns the components with the largest errors among the components included in the error test.
    fn worst_components(&mut self, test_failed: bool) -> Result<Vec<WorstComponent>, Error> {
        let mut errors = vec![0.0; self.n];
        self.estimated_local_errors(&mut errors)?;
        let mut weights = vec![0.0; self.n];
        self.error_weights(&mut weights)?;
        if let Some(tested) = self.suppressed.as_ref().filter(|_| test_failed) {
            for (weight, tested) in weights.iter_mut().zip(tested) {
                *weight *= tested;
            }
        }
        let weighted = errors.iter().zip(&weights).map(|(e, w)| e * w);
        Ok(WorstComponent::largest(self.problem(), weighted))
    }

    /// Restarts at (t0, y0, ẏ0) with the same problem and settings; counters restart at zero. Quadratures restart from
    /// `q0` (empty without quadratures). Sensitivities restart from the initial S and Ṡ if t0 is the time of the first
    /// start; otherwise they must be given, see [`reinit_with_sensitivities`](IdaSolver::reinit_with_sensitivities).
    ///
    /// # Errors
    /// Returns [`Error::SensitivitiesDue`] if sensitivities must be given; [`IntegratorError::WrongLength`],
    /// [`IntegratorError::NotFinite`] or [`IntegratorError::InvalidOption`] if values are invalid; and [`Error::Call`]
    /// if IDAS rejects the call.
    pub fn reinit(&mut self, t0: f64, y0: &[f64], y_dot0: &[f64], q0: &[f64]) -> Result<(), Error> {
        expect_state(self.n, t0, y0, y_dot0)?;
        expect_vector("initial values of the quadratures", self.n_quadratures(), q0)?;
        if let Some(linearized) = &self.functions().sensitivities
            && linearized.t_start != t0
        {
            let t_start = linearized.t_start;
            return Err(Error::SensitivitiesDue { t: t0, t_start });
        }
        let goes_on = self.ida.counter(Counter::Steps) > 0 && t0 == self.t;
        self.call(|ida| ida.reinit(t0, y0, y_dot0, q0))?;
        self.forget_backward_runs()?;
        self.functions_mut().linear.forget_rcond();
        self.functions_mut().zeros.clear();
        self.functions_mut().repetitions = Repetitions::from(t0);
        if let Some(within) = &mut self.functions_mut().within {
            within.evaluations = 0;
        }
        let starts = self.functions().sensitivities.as_ref();
        let starts = starts.map_or(Vec::new(), |linearized| linearized.starts.clone());
        self.call(|ida| ida.reinit_sensitivities(&starts))?;
        if self.stop_time.is_some_and(|stop| stop <= t0) {
            self.stop_time = None;
            self.stop_time_lingers = true;
        }
        (self.t, self.mark, self.refusal) = (t0, (0, t0), None);
        self.start_from(t0, [y0.to_vec(), y_dot0.to_vec()]);
        if goes_on {
            self.consistent = Ok(());
        }
        self.differences_before = self.difference_evaluations();
        Ok(())
    }

    /// Stores the initial values and the result of their consistency check.
    fn start_from(&mut self, t: f64, [y, y_dot]: [Vec<f64>; 2]) {
        let (functions, mut weights) = (self.functions_mut(), vec![0.0; y.len()]);
        let (problem, weighing) = (&mut functions.problem, &mut functions.weighing);
        self.consistent = match weighing.write(problem, &y, &mut weights) {
            Ok(()) => check_start(problem, (t, &y, &y_dot), &weights),
            // The error is reported in the first step.
            Err(_) => Ok(()),
        };
        (self.t0, self.start) = (t, [y, y_dot]);
    }

    /// Sets a stop time: no step passes it, and it is removed when it is reached.
    ///
    /// # Errors
    /// Returns [`IntegratorError::InvalidOption`] if `t` is not finite, and [`Error::Call`] if `t` is before the time
    /// reached.
    pub fn set_stop_time(&mut self, t: f64) -> Result<(), Error> {
        expect_finite_value("stop_time", t)?;
        if self.forward_run.is_some() {
            let what = "a stop time";
            return Err(Error::NotWithCheckpoints { what });
        }
        let direction = self.ida.last_step();
        if (t - self.t) * direction < 0.0 {
            return Err(IntegratorError::TimeBehind { t_out: t, t: self.t }.into());
        }
        self.call(|ida| ida.set_stop_time(t))?;
        (self.stop_time, self.stop_time_lingers) = (Some(t), false);
        Ok(())
    }

    /// Returns the number of residual evaluations for difference quotients since the solver was built.
    fn difference_evaluations(&self) -> u64 {
        let functions = self.functions();
        let of_sensitivities = functions.sensitivities.as_ref();
        functions.linear.difference_evaluations()
            + of_sensitivities.map_or(0, |sensitivities| sensitivities.difference_evaluations())
    }

    fn functions(&self) -> &UserFunctions<P> {
        &self.ida.boundary().callbacks
    }

    fn functions_mut(&mut self) -> &mut UserFunctions<P> {
        &mut self.ida.boundary_mut().callbacks
    }

    /// Resumes a panic that was caught before control returned to C.
    fn resume_panic(&mut self) {
        if let Some(panic) = self.ida.boundary_mut().panic.take() {
            resume_unwind(panic);
        }
    }

    /// Calls IDAS. Converts a rejected call to an error with the message of IDAS.
    fn call<T>(
        &mut self,
        call: impl FnOnce(&mut Ida<UserFunctions<P>>) -> Result<T, CallFailed>,
    ) -> Result<T, Error> {
        let result = call(&mut self.ida);
        result.map_err(|failed| call_error(failed, self.functions_mut().failures.take_message()))
    }
}

integrator_by_own_methods!([P: Problem] IdaSolver<P>, P, Error, reinit);

fn call_error(failed: CallFailed, message: String) -> Error {
    let CallFailed { call, code } = failed;
    Error::Call { call, code, name: codes::name(code), message }
}

/// Returns whether the steps were on average shorter than the spacing of floating-point numbers at t, if `steps` steps
/// advanced t by `advance`.
fn is_unresolved(advance: f64, t: f64, steps: u64) -> bool {
    advance.abs() <= steps as f64 * f64::EPSILON * t.abs()
}

#[cfg(test)]
mod tests {
    use super::is_unresolved;

    /// Regression test: 500 steps of 1.8e-17 at t = 0.315, each rounded to 2.8e-17, were counted as progress, and the
    /// run did not end.
    #[test]
    fn steps_below_the_resolution_of_time_are_no_progress() {
        let t: f64 = 0.31486269610622913;
        assert!(is_unresolved(500.0 * 2.8e-17, t, 500));
        assert!(is_unresolved(0.0, 0.0, 500));
        // A step of four spacings of floating-point numbers at t, and steps near t = 0.
        assert!(!is_unresolved(500.0 * 4.0 * (t.next_up() - t), t, 500));
        assert!(!is_unresolved(1e-300, 1e-300, 500));
    }
}

//! Successive steps of the integrator.

use myovib_dae::checks::expect;
use myovib_dae::{
    IntegratorError, LinearSolver, Linearization, Outcome, Problem, Stop, StopReason,
    WorstComponent,
};

use super::state::{JacobianAge, RadauSolver, step_of};
use super::verification::DIFFERENT;
use crate::control::FACTORS;
use crate::dense::{add_scaled, change_of_start, write_combined};
use crate::error::RadauError;
use crate::failure::{Failure, Failures, Rejection};
use crate::options::StepSize;

/// Number of remaining steps before a time limit below which the remaining time is divided into equal steps.
const SHARED: f64 = 4.0;

/// Fraction of a step below which the remaining time is attributed to rounding of t.
const SLIVER: f64 = 1e-8;

/// Ratio of t to the time scale above which the effect of rounding t in a few hundred steps may exceed tight
/// tolerances.
const LATE: f64 = 1e4;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Takes one step toward `t_out`; the error determines the step size.
    ///
    /// `t_out` provides the time scale for the first step. Steps may pass `t_out`, but not the stop time. After a root,
    /// the call searches the rest of the step for further roots and returns at the end of the step. Memory is allocated
    /// only if a step is rejected, pivots are selected again, or a root is found.
    ///
    /// # Errors
    /// Returns [`IntegratorError::TimeBehind`](myovib_dae::IntegratorError::TimeBehind) or another error for invalid
    /// calls, and [`RadauError::Fatal`] if the problem or the linear algebra returns a fatal error.
    pub fn step(&mut self, t_out: f64) -> Result<Outcome, RadauError> {
        self.interpolation.active = self.options.dense_output;
        if self.counters.statistics.steps == 0 {
            let is_other = t_out != self.t;
            expect("t_out", t_out, is_other, "different from t at the first step")?;
        }
        let outcome = self.step_within(t_out, self.options.stop_time)?;
        if matches!(outcome, Outcome::StopTime { .. }) {
            self.options.stop_time = None;
        }
        Ok(outcome)
    }

    /// Integrates up to `t_out`, unless a root or the stop time comes first.
    ///
    /// The size of the last step is chosen so that the step ends at `t_out`, because dense output is less accurate than
    /// the solution at the ends of steps. The only exception is a step that was paused at a root and ends beyond
    /// `t_out`.
    ///
    /// # Errors
    /// Returns the same errors as [`step`](RadauSolver::step).
    pub fn integrate_to(&mut self, t_out: f64) -> Result<Outcome, RadauError> {
        self.integrate_watched(t_out, &mut |_| Ok(()))
    }

    /// Integrates as [`integrate_to`](RadauSolver::integrate_to) does, and calls a function after each accepted step.
    pub(crate) fn integrate_watched(
        &mut self,
        t_out: f64,
        accepted: &mut dyn FnMut(&mut Self) -> Result<(), RadauError>,
    ) -> Result<Outcome, RadauError> {
        self.interpolation.active = self.options.dense_output && self.roots.is_some();
        let stop_time = self.options.stop_time.unwrap_or(f64::INFINITY);
        let most = self.options.max_steps.map_or(u64::MAX, |most| most as u64);
        let before = self.counters.statistics.steps;
        loop {
            let outcome = self.step_within(t_out, Some(t_out.min(stop_time)))?;
            accepted(self)?;
            match outcome {
                Outcome::StepTaken { .. } => {}
                Outcome::StopTime { t } if t < stop_time => return Ok(Outcome::Reached { t }),
                Outcome::StopTime { t } => {
                    self.options.stop_time = None;
                    return Ok(Outcome::StopTime { t });
                }
                other => return Ok(other),
            }
            if self.counters.statistics.steps - before >= most {
                let message = format!("the limit of {most} steps per call was reached");
                return Ok(self.stop(StopReason::MaxSteps, message));
            }
        }
    }

    /// Takes one step that does not pass `limit`. The step is repeated until it is accepted.
    pub(super) fn accepted_step(&mut self, t_out: f64, limit: f64) -> Result<Outcome, RadauError> {
        match std::mem::replace(&mut self.weights_result, Ok(())) {
            Ok(()) => {}
            Err(Failure::Rejected(Rejection { reason, message, .. })) => {
                self.update_weights();
                return Ok(self.stop(reason, message));
            }
            Err(Failure::Fatal(fatal)) => {
                return Err(fatal.in_step(self.t, self.h.unwrap_or(0.0)));
            }
        }
        self.start.map_err(IntegratorError::from)?;
        self.time_limits = [t_out, limit];
        let mut wanted = match self.h {
            Some(h) => h,
            None => match self.initial_step(t_out, limit) {
                Ok(h) => {
                    if self.counters.statistics.steps == 0 {
                        self.collocation.stretch_line(h);
                    }
                    h
                }
                Err(fatal) => return Err(fatal.in_step(self.t, 0.0)),
            },
        };
        let mut failures = Failures::after(self.refused.is_some(), self.near_kink);
        let mut refused = self.refused.take();
        let mut cause = String::new();
        loop {
            self.h = Some(wanted);
            let (smallest, bound) = self.shortest_step();
            if wanted < smallest {
                let message =
                    format!("the next step, {wanted:e}, is below {bound}, {smallest:e}{cause}");
                return Ok(self.stop(StopReason::StepTooSmall, message));
            }
            let mut h = self.step_size_within(wanted, limit);
            let Rejection { reason, message, step_factor } = match self.attempt(&mut h, failures) {
                Ok(proposal) => {
                    self.near_kink = self.may_be_near_kink(h, failures);
                    // The step must not grow after failures, because all stages of a longer step may be beyond a kink.
                    let next = match failures.any() && !self.near_kink {
                        true => proposal.min(h),
                        false => proposal,
                    };
                    self.refused = refused.filter(|_| next <= h);
                    return Ok(self.finish_step(h, wanted, limit, next));
                }
                Err(Failure::Fatal(fatal)) => return Err(fatal.in_step(self.t, h)),
                Err(Failure::Rejected(rejection)) => rejection,
            };
            if !failures.any() {
                match self.return_to_constraints(h) {
                    Err(Failure::Fatal(fatal)) => return Err(fatal.in_step(self.t, h)),
                    // The attempt has already failed for another reason, so a failure here has no effect.
                    Ok(()) | Err(Failure::Rejected(_)) => {}
                }
            }
            failures.count(reason, &mut self.counters.statistics);
            if Failures::is_refusal(reason) {
                refused = Some(message.clone());
            }
            let too_many = failures.too_many(&self.options);
            if matches!(self.options.step_size, StepSize::Fixed(_)) || (too_many && self.fresh) {
                return Ok(self.stop(reason, message));
            }
            if too_many {
                // If the input is discontinuous, the previous steps may give wrong predictions.
                self.start_afresh();
                failures.forget_counts();
            }
            wanted = h * failures.factor(step_factor, self.fresh);
            cause = format!(", after: {}", refused.as_ref().unwrap_or(&message));
        }
    }

    /// Treats the next step as a first step.
    pub(super) fn start_afresh(&mut self) {
        self.fresh = true;
        self.predictor.forget();
        self.control.forget();
        self.jacobian = JacobianAge::Due;
    }

    /// Accepts the step of size `h` and selects the size of the next step from the `proposal` of the step-size control.
    fn finish_step(&mut self, h: f64, wanted: f64, limit: f64, proposal: f64) -> Outcome {
        let at_limit = h >= limit - self.t;
        self.accept(h, if at_limit { limit } else { self.t + h });
        if self.last_step_jumped() {
            self.start_afresh();
        }
        // If a step was shortened to meet a limit, and the proposal grows by the largest permitted factor, the next
        // step may have the size from before the shortening.
        let next = if h < wanted && proposal >= FACTORS.1 * h {
            proposal.max(wanted)
        } else {
            self.step_size_after(h, proposal)
        };
        self.h = Some(next.min(self.largest_step()));
        let t = self.t;
        if at_limit { Outcome::StopTime { t } } else { Outcome::StepTaken { t } }
    }

    /// Accepts the step just computed, which ends at `t`, as the last step.
    fn accept(&mut self, h: f64, t: f64) {
        self.predictor.learn(&self.newton.z, self.weights.scaled());
        let is_after_jump = self.last_step_jumped();
        self.collocation.t0 = self.t;
        self.collocation.h = h;
        self.collocation.y0.copy_from_slice(&self.y);
        self.collocation.y_dot0.copy_from_slice(&self.y_dot);
        std::mem::swap(&mut self.collocation.increments, &mut self.newton.z);
        let step = step_of!(self, h);
        self.multipliers.remove(&step, &mut self.collocation.increments);
        if is_after_jump || self.starts_far_from_multipliers() {
            self.extrapolate_start();
            self.collocation.free_start(&self.method, 0..self.y.len());
            self.jump = None;
        } else {
            // For algebraic variables, û then equals u, whose values at the nodes satisfy the algebraic equations.
            let algebraic = self.algebraic.iter().copied();
            self.collocation.free_start(&self.method, algebraic);
            let contradicted = self.contradicted_slopes();
            self.collocation.free_start(&self.method, contradicted);
        }
        if let Some(quadrature) = &mut self.quadrature {
            quadrature.accept(&self.method, self.t, h, self.fresh);
        }
        if let Some(internal) = &mut self.internal {
            internal.accept((&self.method, h));
        }

        let last = self.method.stages() - 1;
        let n = self.y.len();
        add_scaled(&mut self.y, 1.0, &self.collocation.increments[last * n..]);
        let slope = |_, j| self.method.a_inverse(last, j) / h;
        write_combined(&mut self.y_dot, n, slope, &self.collocation.increments);
        self.t = t;
        self.began_afresh = self.fresh;
        self.fresh = false;
        self.update_weights();
        if self.matrices.pivot_choices() != self.pivot_choices {
            // If a solve has selected new pivots for one matrix, the next setup selects them for all matrices.
            (self.pivots_due, self.set_up_for) = (true, None);
        }
        let reusable = self.newton.contraction <= self.options.jacobian_reuse;
        self.jacobian = if reusable { JacobianAge::Old } else { JacobianAge::Due };

        let statistics = &mut self.counters.statistics;
        if statistics.steps == 0 {
            statistics.initial_step = h;
        }
        statistics.steps += 1;
        statistics.last_step = h;
        statistics.last_order = self.method.order();
        statistics.t_reached = t;
    }

    /// Returns whether the multipliers of index 2 at the start of the first step just computed are far from the
    /// polynomial through the stages. The steps do not depend on the initial multipliers, which may be wrong. For index
    /// 3, rounding in a short first step may have the same effect.
    fn starts_far_from_multipliers(&self) -> bool {
        let mut multipliers = (self.algebraic.iter()).filter(|&&i| self.multipliers.index(i) == 2);
        let is_far = |&i: &usize| {
            let far = DIFFERENT * self.weights.solution_tolerance(i);
            self.change_of_start(i).abs() > far
        };
        let is_adaptive = self.options.step_size == StepSize::Adaptive;
        is_adaptive && self.fresh && multipliers.any(is_far)
    }

    /// Returns the variables whose initial derivative would change the polynomial of the first step just computed by
    /// more than the tolerance. The initial derivatives may be wrong, because the step does not depend on them, whereas
    /// the polynomial without them has been verified.
    fn contradicted_slopes(&self) -> Vec<usize> {
        if !self.fresh || self.options.step_size != StepSize::Adaptive {
            return Vec::new();
        }
        let scale = self.collocation.h * self.method.largest_ramp();
        let mut slopes = vec![0.0; self.y.len()];
        self.collocation.start_slope(&self.method, &mut slopes);
        let change = |i: usize| scale * (self.collocation.y_dot0[i] - slopes[i]).abs();
        (0..self.y.len()).filter(|&i| change(i) > self.weights.solution_tolerance(i)).collect()
    }

    /// Replaces the algebraic variables at the start of the step just computed by the values of the polynomial through
    /// the stages, because the initial values may be from before a jump.
    fn extrapolate_start(&mut self) {
        for k in 0..self.algebraic.len() {
            let i = self.algebraic[k];
            let change = self.change_of_start(i);
            self.collocation.change_start(i, change);
            self.y[i] += change;
        }
    }

    /// Returns the change of component i at the start of the step just computed, as applied by
    /// [`extrapolate_start`](Self::extrapolate_start).
    fn change_of_start(&self, i: usize) -> f64 {
        change_of_start(&self.method, self.y.len(), &self.collocation.increments, i)
    }

    /// Computes the weights at y.
    pub(super) fn update_weights(&mut self) {
        let (problem, options) = (&mut self.problem, &self.options);
        self.weights_result = self.weights.update(problem, options, &self.y);
        if self.weights_result.is_err() {
            return;
        }
        let relative = match self.weights.implied_relative(&self.y) {
            Some(internal) => options.relative_for(internal),
            None => options.accuracy(&self.y),
        };
        self.newton.set_tolerance(options.newton_tolerance(relative, self.multipliers.any()));
        self.weights.set_factors(options.weight_factors(relative));
        self.control.set_loosened(options.internal_factor(relative));
    }

    /// Returns the size of the next step after a step of size h. It remains h if this saves a matrix setup.
    pub(super) fn step_size_after(&self, h: f64, proposal: f64) -> f64 {
        let (low, high) = self.options.step_window;
        if self.jacobian == JacobianAge::Old && (low..=high).contains(&(proposal / h)) {
            h
        } else {
            proposal
        }
    }

    /// Returns the minimum step size and the name of the bound that determines it.
    pub(super) fn shortest_step(&self) -> (f64, &'static str) {
        let rounding = self.rounding_of_t();
        match self.options.min_step > rounding {
            true => (self.options.min_step, "min_step"),
            false => (rounding, "the rounding of t"),
        }
    }

    /// Returns a few rounding errors of t.
    pub(super) fn rounding_of_t(&self) -> f64 {
        (10.0 * f64::EPSILON * self.t.abs()).max(f64::MIN_POSITIVE)
    }

    pub(super) fn largest_step(&self) -> f64 {
        self.options.max_step.unwrap_or(f64::INFINITY)
    }

    /// Returns the step size `wanted`, adapted to the remaining time. The last few steps share this time equally,
    /// because in a step much shorter than the previous one, the remaining residual of the longer step would cause
    /// errors of multipliers.
    fn step_size_within(&self, wanted: f64, limit: f64) -> f64 {
        let fixed = matches!(self.options.step_size, StepSize::Fixed(_));
        let left = limit - self.t;
        match left / wanted {
            // Rounding of t must neither cause a tiny last step nor affect the number of steps that share the remaining
            // time.
            ratio if ratio <= 1.0 + SLIVER => left,
            ratio if ratio < SHARED && !fixed => self.rounded(left / (ratio - SLIVER).ceil()),
            // A constant size saves matrix setups.
            _ if fixed => wanted,
            _ => self.rounded(wanted),
        }
    }

    /// Returns a step size near `h` for which t + h is exact if t is large compared with the time scale. Without this
    /// change, the effect of the difference between the time and the sum of the steps would exceed the tolerances.
    pub(super) fn rounded(&self, h: f64) -> f64 {
        match self.t.abs() > LATE * self.options.time_scale {
            true => (self.t + h) - self.t,
            false => h,
        }
    }

    pub(super) fn stop(&mut self, reason: StopReason, message: String) -> Outcome {
        let n = self.y.len();
        let weighted: Vec<f64> = match reason {
            StopReason::ConvergenceFailures => {
                (0..n).map(|i| self.newton.correction()[i] * self.weights.scaled()[i]).collect()
            }
            _ => (0..n).map(|i| self.error_test.error(i) * self.weights.scaled()[i]).collect(),
        };
        let worst = WorstComponent::largest(&self.problem, weighted);
        let mut stop = Stop::new(reason, message, self.t(), self.statistics(), worst);
        if self.options.check_jacobian_at_stop {
            let (t, step, weights) = (self.t, self.h.unwrap_or(0.0), self.weights.plain());
            let at = Linearization { t, y: &self.y, y_dot: &self.y_dot, step, weights };
            stop = stop.examined(&mut self.problem, &at);
        }
        Outcome::Stopped(Box::new(stop.advised(&self.problem, &self.kinds, 3)))
    }
}

//! One attempt at a step: Jacobian, matrix setup, Newton iterations, error test.

use myovib_dae::{LinearSolver, Linearization, Problem, StepError, StopReason, VariableKind};

use super::state::{JacobianAge, RadauSolver, step_of};
use crate::dense::{add_scaled, write_combined};
use crate::failure::{Failure, Failures, Operation, Rejection};
use crate::internal_variables::EliminatedVariables;
use crate::newton::{Newton, norm};
use crate::options::StepSize;
use crate::rounding::Sampling;

/// Ratio of the displacements of difference quotients near a kink to the usual displacements.
const FINE: f64 = 1e-4;

/// Maximum norm of the increments for which a step across a kink is accepted.
const NEAR: f64 = 10.0;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Solves a step of size `h` and tests its error. Returns the size proposed for the next step.
    pub(super) fn attempt_once(&mut self, h: f64, failures: Failures) -> Result<f64, Failure> {
        if let Some(internal) = &mut self.internal {
            internal.begin(&mut self.problem, (&self.method, h), self.t, &self.y)?;
        }
        let iterations = self.solve_stages(h, failures)?;
        let step = step_of!(self, h);
        let free: &[usize] = match self.may_be_near_kink(h, failures) {
            true => &self.algebraic,
            false => &[],
        };
        if failures.unsolved() && self.newton.leaps(&step, &self.y_dot, free) {
            // The iterations have converged to another root of F with a very different ẏ, which the error test of y
            // does not detect.
            return Err(Failure::Rejected(Rejection {
                reason: StopReason::ConvergenceFailures,
                message: format!("ẏ changes abruptly while y barely changes at h = {h:e}"),
                step_factor: 0.5,
            }));
        }
        if failures.refused() && self.multipliers.any() {
            self.expect_small_rounding(h)?;
        }
        let proposal = match self.options.step_size {
            StepSize::Fixed(proposal) => {
                self.measure_multipliers(h)?;
                proposal
            }
            StepSize::Adaptive => self.test_error(h, failures, iterations)?,
        };
        self.evaluate_quadratures(h)?;
        Ok(proposal)
    }

    /// Rejects a step and all shorter steps if it is so short that rounding errors exceed the tolerances.
    fn expect_small_rounding(&mut self, h: f64) -> Result<(), Failure> {
        self.sample_rounding(h, None)?;
        let (n, weights) = (self.y.len(), self.weights.scaled());
        if norm((0..n).map(|i| self.rounding.of(i) * weights[i]), n) < 1.0 {
            return Ok(());
        }
        Err(Failure::Rejected(Rejection {
            reason: StopReason::ErrorTestFailures,
            message: format!("rounding exceeds the tolerances at h = {h:e}"),
            step_factor: 0.0,
        }))
    }

    /// Estimates the rounding error of a step of size `h` after a step of size `last` by thorough sampling.
    pub(super) fn sample_rounding(&mut self, h: f64, last: Option<f64>) -> Result<(), Failure> {
        let step = step_of!(self, h);
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let (rounding, counters) = (&mut self.rounding, &mut self.counters);
        let at_start = (&self.y_dot[..], last);
        rounding.sample(problem, matrices, &step, at_start, Sampling::THOROUGH, counters)
    }

    /// Evaluates the integrands at the stages, with multipliers from which the leading errors have been removed.
    fn evaluate_quadratures(&mut self, h: f64) -> Result<(), Failure> {
        let Some(quadrature) = &mut self.quadrature else {
            return Ok(());
        };
        let step = step_of!(self, h);
        let (multipliers, z) = (&self.multipliers, &self.newton.z);
        let increments = |out: &mut [f64]| {
            out.copy_from_slice(z);
            multipliers.remove_from_copy(&step, out);
        };
        quadrature.evaluate(&mut self.problem, &step, increments, &mut self.counters)
    }

    /// Tests the estimated error of the solved step. If the step passes, returns the size proposed for the next step.
    fn test_error(
        &mut self,
        h: f64,
        failures: Failures,
        iterations: usize,
    ) -> Result<f64, Failure> {
        let step = step_of!(self, h);
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let (z, filter_twice) = (&self.newton.z, self.fresh || failures.any());
        let (internal, counters) = (self.internal.as_mut(), &mut self.counters);
        let test = &mut self.error_test;
        let mut error =
            test.estimate(problem, matrices, internal, &step, (z, filter_twice), counters)?;
        if let Some(internal) = &self.internal {
            internal.show_present(problem);
        }
        // If there is a hidden constraint, a shorter step has larger rounding errors. Therefore, steps must be neither
        // shortened nor repeated because of rounding errors.
        let control = &self.control;
        let shortens = control.propose(h, error, iterations) < h || control.judge(h, error) >= 1.0;
        let questioned = error >= 1.0 || (self.multipliers.any() && shortens);
        if error.is_finite() && questioned && !failures.refused() {
            let (rounding, n, errors) = (&mut self.rounding, step.y.len(), &self.error_test);
            let last = (counters.statistics.steps > 0).then_some(self.collocation.h);
            for &sampling in rounding.samplings() {
                let at_start = (&self.y_dot[..], last);
                rounding.sample(problem, matrices, &step, at_start, sampling, counters)?;
                let beyond = |i| rounding.beyond(i, errors.error(i));
                error = norm((0..n).map(|i| beyond(i) * step.weights[i]), n);
                error = error.hypot(self.internal.as_ref().map_or(0.0, EliminatedVariables::error));
                if self.control.judge(h, error) < 1.0 {
                    break;
                }
            }
        }
        let judged = self.control.judge(h, error);
        if judged.is_nan() || judged >= 1.0 {
            return Err(Failure::Rejected(self.reject(h, error, judged, iterations)));
        }
        let for_output = self.test_dense_output(h, iterations)?;
        let for_multipliers = self.measure_multipliers(h)?;
        let limit = for_output.min(for_multipliers);
        let limit = limit.min(self.limit_for_output_of_index_2(h, limit)?);
        self.expect_smooth_multipliers(h)?;
        let next = limit.min(self.control.propose(h, error, iterations));
        self.expect_no_unseen_input(h, next)?;
        Ok(limit.min(self.control.accept(h, error, iterations)))
    }

    /// Rejects a step with the estimated `error`. `judged` is the error that the step-size control compares with the
    /// tolerance.
    fn reject(&mut self, h: f64, error: f64, judged: f64, iterations: usize) -> Rejection {
        if !error.is_finite() {
            return Rejection {
                reason: StopReason::LinearSolveFailed,
                message: format!("the estimated error is not finite at h = {h:e}"),
                step_factor: 0.5,
            };
        }
        self.control.reject(h, error);
        Rejection {
            reason: StopReason::ErrorTestFailures,
            message: format!("estimated error {judged:.2e} times the tolerance at h = {h:e}"),
            // The time scale is unknown in a first step.
            step_factor: match self.fresh {
                true => 0.1,
                false => self.control.propose(h, judged, iterations) / h,
            },
        }
    }

    /// Estimates the leading error of multipliers. Returns the largest next step size allowed by the error
    /// remaining after the removal of the leading error.
    fn measure_multipliers(&mut self, h: f64) -> Result<f64, Failure> {
        let step = step_of!(self, h);
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let Some(order) = self.multipliers.order(self.method.stages()) else {
            return Ok(f64::INFINITY);
        };
        let before = (self.counters.statistics.steps > 0).then_some(&self.collocation);
        let (counters, at_start) = (&mut self.counters, (&self.y_dot[..], &self.newton.z[..]));
        let multipliers = &mut self.multipliers;
        multipliers.measure(problem, matrices, &step, before, at_start, counters)?;
        let tolerance = |i| self.weights.own_tolerance(i);
        let growth = self.options.growth_in_noise();
        let mut left = multipliers.largest_left(&step, before, tolerance, |_| 0.0, growth);
        let mut shortest = 0.0;
        if left >= 1.0 {
            let rounding = &mut self.rounding;
            for &sampling in rounding.samplings() {
                let at_start = (&self.y_dot[..], before.map(|before| before.h));
                rounding.sample(problem, matrices, &step, at_start, sampling, counters)?;
                let beyond = |i| rounding.of(i);
                left = multipliers.largest_left(&step, before, tolerance, beyond, growth);
                if self.control.propose_for_multipliers(h, left, order) >= h {
                    break;
                }
            }
            // In steps shorter than this, the rounding errors of multipliers would exceed their tolerances.
            shortest = self.shortest_resolved(h).min(h);
        }
        let proposal = self.control.propose_for_multipliers(h, left, order);
        Ok(proposal.max(shortest))
    }

    /// Solves the stage equations, with a new Jacobian if Newton's method fails with the current one. Returns the
    /// number of iterations.
    fn solve_stages(&mut self, h: f64, failures: Failures) -> Result<usize, Failure> {
        self.weights.scale(h);
        loop {
            self.evaluate_jacobian(h)?;
            self.set_up(h)?;
            let failure = match self.iterate(h, failures) {
                Ok(iterations) => return Ok(iterations),
                Err(failure) => failure,
            };
            let Failure::Rejected(rejection) = failure else {
                return Err(failure);
            };
            self.counters.statistics.newton_failures += 1;
            // If the Jacobian is from an earlier step, it may be the reason for slow convergence.
            let slow = rejection.reason == StopReason::ConvergenceFailures;
            if slow && self.jacobian != JacobianAge::Current {
                self.jacobian = JacobianAge::Due;
                continue;
            }
            return match slow && self.may_be_near_kink(h, failures) {
                true => self.solve_beyond_kink(h, failures, rejection),
                false => Err(Failure::Rejected(rejection)),
            };
        }
    }

    /// Solves the stage equations with Jacobians at the end of the step, after Newton's method has failed with the
    /// Jacobian at its start. Returns `rejection` if these Jacobians fail as well.
    ///
    /// F may have a kink near the start, for example at the threshold of an ideal diode, and the start may be on the
    /// wrong side of the kink. The predicted or iterated values at the end of the step may be on the other side. Up to
    /// six Jacobians are evaluated and factorized, one after each failure. Only steps in which the solution changes by
    /// about the tolerances are solved in this way, because the iterations could otherwise converge to other roots of
    /// F.
    fn solve_beyond_kink(
        &mut self,
        h: f64,
        failures: Failures,
        rejection: Rejection,
    ) -> Result<usize, Failure> {
        let (n, last) = (self.y.len(), self.method.stages() - 1);
        // The displacements are smaller than the tolerances, because displacements by the tolerances may cross the
        // kink.
        let weights: Vec<f64> = self.weights.plain().iter().map(|w| w / FINE).collect();
        let iterated = self.newton.z.clone();
        // The iterations may alternate between the two sides of the kink.
        let mut before = iterated.clone();
        add_scaled(&mut before[last * n..], -1.0, self.newton.correction());
        let mut predicted = vec![0.0; iterated.len()];
        self.predictor.start(&self.method, &self.collocation, (self.t, h), &self.y, &mut predicted);
        let candidates = [predicted, iterated, before];
        // Displacements in the direction of motion and in the opposite direction are tried, because at least one of
        // them does not cross the kink.
        for (z, step) in [h, -h].iter().flat_map(|step| candidates.iter().map(move |z| (z, *step)))
        {
            let (mut y, mut y_dot) = (self.y.clone(), vec![0.0; n]);
            add_scaled(&mut y, 1.0, &z[last * n..]);
            write_combined(&mut y_dot, n, |_, j| self.method.a_inverse(last, j) / h, z);
            let at = Linearization { t: self.t + h, y: &y, y_dot: &y_dot, step, weights: &weights };
            self.jacobian_point.note(&at, &[]);
            let prepared = self.evaluate_jacobian_at_point().and_then(|()| self.set_up(h));
            match prepared.and_then(|()| self.iterate(h, failures)) {
                Ok(iterations) if self.newton.size() < NEAR && self.keeps_rates(h) => {
                    return Ok(iterations);
                }
                Ok(_) | Err(Failure::Rejected(_)) => {}
                Err(fatal) => return Err(fatal),
            }
        }
        self.jacobian = JacobianAge::Due;
        Err(Failure::Rejected(rejection))
    }

    /// Returns whether the derivatives that occur in F change by at most half of their size in the step just solved. If
    /// they change by more, the iterations may have converged to another root of F.
    fn keeps_rates(&self, h: f64) -> bool {
        let (n, last) = (self.y.len(), self.method.stages() - 1);
        let mut y_dot = vec![0.0; n];
        write_combined(&mut y_dot, n, |_, j| self.method.a_inverse(last, j) / h, &self.newton.z);
        let weight = |i: usize| match self.kinds[i] {
            VariableKind::Differential => self.weights.plain()[i],
            VariableKind::Algebraic => 0.0,
        };
        let change = norm((0..n).map(|i| weight(i) * (y_dot[i] - self.y_dot[i])), n);
        change <= 0.5 * norm((0..n).map(|i| weight(i) * self.y_dot[i]), n)
    }

    /// Returns whether a step of size `h` may start near a kink that difference quotients do not resolve. This is
    /// assumed if Newton's method has failed repeatedly although the solution changes by less than its tolerance. It is
    /// not assumed for exact Jacobians, which always describe one side of a kink.
    pub(super) fn may_be_near_kink(&self, h: f64, failures: Failures) -> bool {
        let has_quotients = self.matrices.difference_evaluations() > 0 && self.internal.is_none();
        if !(has_quotients && failures.suggest_kink()) {
            return false;
        }
        let weighted = self.y_dot.iter().zip(self.weights.plain()).map(|(v, w)| h * v * w);
        norm(weighted, self.y.len()) <= 1.0
    }

    /// Runs Newton iterations with the current matrices. Returns the number of iterations.
    fn iterate(&mut self, h: f64, failures: Failures) -> Result<usize, Failure> {
        let z = &mut self.newton.z;
        let (method, last) = (&self.method, &self.collocation);
        self.predictor.start(method, last, (self.t, h), &self.y, z);
        let step = step_of!(self, h);
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let (newton, counters) = (&mut self.newton, &mut self.counters);
        let by_differences = matrices.difference_evaluations() > 0;
        newton.set_strict(self.options.dense_output || by_differences, by_differences);
        let mut internal = self.internal.as_mut();
        let of_stages = internal.as_deref_mut();
        let solved = newton.solve(problem, matrices, of_stages, &step, &self.weights, counters)?;
        if let Some(internal) = internal {
            newton.evaluate_driving_quantities(problem, internal, &step)?;
            internal.show_present(problem);
        }
        match solved {
            Newton::Converged { iterations } => Ok(iterations),
            Newton::Failed { step_factor } => {
                let (rounding, newton) = (&mut self.rounding, &self.newton);
                let (corrections, n) = (newton.correction(), step.y.len());
                let samplings = rounding.samplings().iter();
                for &sampling in samplings.filter(|_| !failures.refused()) {
                    let at_start = (&self.y_dot[..], None);
                    rounding.sample(problem, matrices, &step, at_start, sampling, counters)?;
                    let left = (0..n).map(|i| rounding.beyond(i, corrections[i]) * step.weights[i]);
                    // A sample may not contain the rounding errors of some components, so the norms of all components
                    // are also compared. In equilibrium, all corrections are rounding errors, and do not contract.
                    let all = (0..n).map(|i| corrections[i] * step.weights[i]);
                    let explained = (0..n).map(|i| rounding.of(i) * step.weights[i]);
                    if norm(left, n) <= newton.allowed() || norm(all, n) <= norm(explained, n) {
                        return Ok(self.options.newton_limit());
                    }
                }
                Err(Failure::Rejected(Rejection {
                    reason: StopReason::ConvergenceFailures,
                    message: format!("Newton does not converge at h = {h:e}"),
                    step_factor,
                }))
            }
        }
    }

    /// Evaluates the Jacobian at the start of the step, if required.
    pub(super) fn evaluate_jacobian(&mut self, h: f64) -> Result<(), Failure> {
        if self.jacobian == JacobianAge::Due {
            let at = Linearization {
                t: self.t,
                y: &self.y,
                y_dot: &self.y_dot,
                step: h,
                weights: self.weights.plain(),
            };
            let response = self.internal.as_ref().map_or(&[][..], EliminatedVariables::present);
            self.jacobian_point.note(&at, response);
            self.evaluate_jacobian_at_point()?;
        }
        Ok(())
    }

    fn evaluate_jacobian_at_point(&mut self) -> Result<(), Failure> {
        self.counters.statistics.jacobian_evaluations += 1;
        (self.jacobian, self.set_up_for) = (JacobianAge::Due, None);
        let at = self.jacobian_point.as_linearization();
        self.matrices.evaluate(&mut self.problem, &at).map_err(Operation::Jacobian.failed())?;
        self.jacobian = JacobianAge::Current;
        Ok(())
    }

    /// Sets up J_y + λ/h J_ẏ for all eigenvalues λ of A⁻¹ if h or the Jacobian has changed.
    pub(super) fn set_up(&mut self, h: f64) -> Result<(), Failure> {
        if self.set_up_for == Some(h) {
            return Ok(());
        }
        self.set_up_for = None;
        self.newton.set_tried(false);
        self.counters.statistics.linear_setups += 1;
        self.counters.work.real_factorizations += 1;
        self.counters.work.complex_factorizations += self.shifts.len() as u64;
        self.choose_pivots_and_factorize(h).map_err(Operation::LinearSetUp.failed())?;
        self.set_up_for = Some(h);
        Ok(())
    }

    /// Factorizes the matrices for a step of size h. If new pivots are selected for one matrix, they are selected for
    /// all matrices, so that all pivots belong to the same evaluation and the same h.
    fn choose_pivots_and_factorize(&mut self, h: f64) -> Result<(), StepError> {
        for (shift, mode) in self.shifts.iter_mut().zip(self.method.complex_modes()) {
            *shift = mode.lambda / h;
        }
        let real = self.method.real_mode().lambda / h;
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        self.pivots_due |= matrices.pivot_choices() != self.pivot_choices;
        if self.pivots_due {
            matrices.forget_pivots();
        }
        let all_anew = self.pivots_due;
        self.pivots_due = true;
        matrices.set_up(problem, real, &self.shifts)?;
        let chosen = matrices.pivot_choices() != self.pivot_choices;
        if chosen && !all_anew {
            matrices.forget_pivots();
            matrices.set_up(problem, real, &self.shifts)?;
        }
        if chosen {
            self.pivots_at = Some((self.jacobian_point.clone(), h));
        }
        self.pivot_choices = matrices.pivot_choices();
        self.pivots_due = false;
        Ok(())
    }
}

//! Verification of first steps, and of multipliers of index 2 in all steps.

use myovib_dae::{LinearSolver, Problem, StopReason};

use super::state::{RadauSolver, step_of};
use crate::control::FACTORS;
use crate::dense::add_scaled;
use crate::failure::{Failure, Failures, Rejection};
use crate::options::StepSize;

/// Maximum number of times that a first step is halved or its initial values are corrected.
const MAX_REPETITIONS: usize = 20;

/// Unexplained error of a multiplier of index 2, in units of its tolerance, above which a jump is assumed. Multipliers
/// may have two correct digits fewer than the tolerance requires. For a smooth solution, the step-size control keeps
/// the unexplained error below about ten tolerances.
const UNEXPLAINED: f64 = 30.0;

/// Difference between two measurements of the leading error of a multiplier of index 2, in units of its tolerance,
/// above which a jump is assumed. One error is measured within the step, the other one from the last step. The leading
/// error of a smooth solution is removed, and may change by several hundred tolerances between steps.
pub(super) const DIFFERENT: f64 = 300.0;

/// Ratio of the sizes of consecutive steps above which an input may act undetected between the stages.
const FAST_GROWTH: f64 = 2.0;

/// Residual between the stages, in units of the tolerances, above which an undetected input is assumed. If the solution
/// is smooth and steps grow fast, the residual is below 1.
const UNSEEN: f64 = 10.0;

/// Corresponding limit for algebraic variables, which are interpolated with a lower order. It is the error of algebraic
/// variables that the guide states.
const UNSEEN_BY_ALGEBRAIC: f64 = 100.0;

/// Fraction of the first rejected step up to which a step that contains a jump is accepted.
const SHORTEST: f64 = 1.0 / 4096.0;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Attempts a step of size `h` and returns the size proposed for the next step. Apart from the result, only the
    /// state of Newton's method and the Jacobian change. In a first step, the initial values are also moved onto
    /// constraints that they violate by less than the tolerances.
    ///
    /// The size of a first step is halved until its polynomial, evaluated at the middle of the step, agrees with the
    /// end of a step of half the size. This is necessary because the error estimate excludes the error of algebraic
    /// variables, and because high orders allow first steps longer than the time scale of the input.
    pub(super) fn attempt(&mut self, h: &mut f64, failures: Failures) -> Result<f64, Failure> {
        if !self.fresh || self.options.step_size != StepSize::Adaptive {
            return self.attempt_once(*h, failures);
        }
        self.move_onto_constraints(0.5 * *h)?;
        let mut last = f64::INFINITY;
        for _ in 0..MAX_REPETITIONS {
            self.attempt_once(0.5 * *h, failures)?;
            let in_half = self.error_test.at_start().map(<[f64]>::to_vec);
            let middle = self.newton.z[self.newton.z.len() - self.y.len()..].to_vec();
            self.control.forget();
            let proposal = self.attempt_once(*h, failures)?;
            let [error, of_index_2] = self.differences(&middle);
            // A difference that does not decrease with h is caused by rounding.
            let is_accurate = error < 1.0 && (of_index_2 < 1.0 || of_index_2 > 0.5 * last);
            if is_accurate && self.is_smooth_within(*h)? {
                let in_half = in_half.each_ref().map(|of_half| &of_half[..]);
                if !self.correct_velocities(*h, in_half)? {
                    return Ok(proposal);
                }
            } else {
                last = of_index_2;
                let half = self.rounded(0.5 * *h);
                if half < self.shortest_step().0 {
                    return Err(Failure::Rejected(Rejection {
                        reason: StopReason::ErrorTestFailures,
                        message: format!(
                            "the first step of size h = {h:e} differs at its midpoint from a step of half the size"
                        ),
                        step_factor: 0.5,
                    }));
                }
                *h = half;
            }
            self.control.forget();
        }
        self.attempt_once(*h, failures)
    }

    /// Returns the largest differences between the increments `at_middle` and the polynomial of the step just solved at
    /// its middle, for variables of index 0 and 1 and for variables of index 2, in units of the tolerances.
    fn differences(&self, at_middle: &[f64]) -> [f64; 2] {
        let n = self.y.len();
        let mut differences: Vec<f64> = at_middle.iter().map(|z| -z).collect();
        for (j, z) in self.newton.z.chunks_exact(n).enumerate() {
            let basis = self.method.basis(j, 0.5);
            add_scaled(&mut differences, basis, z);
            if self.last_step_jumped() {
                // The initial values of multipliers are unknown.
                for &i in &self.algebraic {
                    differences[i] += basis * (self.method.nodes()[j] / 0.5 - 1.0) * z[i];
                }
            }
        }
        let mask = self.error_test.mask();
        let mut largest = [0.0_f64; 2];
        for i in 0..n {
            let difference = mask[i] * differences[i].abs();
            match self.multipliers.index(i) {
                0 | 1 => {
                    let tolerance = match self.interpolation.active {
                        true => self.weights.solution_tolerance(i),
                        false => 1.0 / self.weights.plain()[i],
                    };
                    largest[0] = largest[0].max(difference / tolerance);
                }
                2 => largest[1] = largest[1].max(difference / self.weights.own_tolerance(i)),
                _ => {}
            }
        }
        largest
    }

    /// Rejects a step in which a multiplier of index 2 jumps, because the error estimate does not include the error of
    /// the multiplier.
    ///
    /// Multipliers of index 2 depend on the derivative of the polynomial. If an input or a characteristic curve has a
    /// kink between the stages, multipliers jump and are wrong at the end of the step, although all equations are
    /// satisfied at the stages. Shorter steps locate the kink. A step that contains the kink is accepted when its size
    /// is at most the fraction [`SHORTEST`] of the first rejected step. The errors of its multipliers are not removed,
    /// and the next step is treated as a first step.
    pub(super) fn expect_smooth_multipliers(&mut self, h: f64) -> Result<(), Failure> {
        let (step, last) = (step_of!(self, h), self.collocation.h);
        let tolerance = |i| self.weights.solution_tolerance(i);
        let is_tested = !self.fresh && self.multipliers.grow_suddenly(&step, last, tolerance);
        if !is_tested || self.is_smooth_within(h)? {
            return Ok(());
        }
        let known = self.jump.filter(|[end, _]| self.t < *end);
        let [end, shortest] = known.unwrap_or([self.t + h, SHORTEST * h]);
        if h <= shortest || !self.resolves_multipliers(h)? {
            self.multipliers.discard();
            self.jump = Some([self.t, 0.0]);
            return Ok(());
        }
        self.jump = Some([end, shortest]);
        Err(Failure::Rejected(Rejection {
            reason: StopReason::ErrorTestFailures,
            message: format!("a multiplier of index 2 jumps in the step of size h = {h:e}"),
            step_factor: 0.25,
        }))
    }

    /// Rejects a step of size `h` in which an input acts between the stages. Only steps that are much longer than the
    /// last step, or that would be followed by a much longer `next` step, are tested.
    ///
    /// If an input acts only between the stages of such steps, the solution seems to be at rest, and the step size
    /// would grow beyond the duration or the period of the input. The test is omitted if `max_step` is set, because
    /// this option limits the steps, as multipliers also do. The option `detect_inputs` disables the test.
    pub(super) fn expect_no_unseen_input(&mut self, h: f64, next: f64) -> Result<(), Failure> {
        let is_limited = !self.options.detect_inputs
            || self.options.max_step.is_some()
            || self.multipliers.any();
        let grown = h / self.collocation.h;
        let grows = next >= FAST_GROWTH * h || grown >= FAST_GROWTH;
        if is_limited || self.fresh || self.internal.is_some() || !grows {
            return Ok(());
        }
        let step = step_of!(self, h);
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        // The growth is bounded, because the last step may have been shortened to meet a limit.
        let solved = (&self.newton.z[..], &self.kinds[..], grown.min(FACTORS.1));
        let counters = &mut self.counters;
        let test = &mut self.error_test;
        match test.between(problem, matrices, &step, solved, counters) {
            Ok([error, _]) if !error.is_finite() => Err(Failure::Rejected(Rejection {
                reason: StopReason::LinearSolveFailed,
                message: format!("the residual between the stages is {error} at h = {h:e}"),
                step_factor: 0.5,
            })),
            Ok(errors) if errors[0] > UNSEEN || errors[1] > UNSEEN_BY_ALGEBRAIC => {
                Err(Failure::Rejected(Rejection {
                    reason: StopReason::ErrorTestFailures,
                    message: format!(
                        "an input acts between the stages of the step of size h = {h:e}"
                    ),
                    step_factor: 0.25,
                }))
            }
            // F may be undefined between the stages.
            Ok(_) | Err(Failure::Rejected(_)) => Ok(()),
            Err(fatal) => Err(fatal),
        }
    }

    /// Returns whether the rounding errors of multipliers of index 2 are within their tolerances in a step of size `h`.
    /// If not, a shorter step would not locate a jump more accurately, because rounding errors grow as 1/h.
    pub(super) fn resolves_multipliers(&mut self, h: f64) -> Result<bool, Failure> {
        if !self.multipliers.are_of_index_2() {
            return Ok(true);
        }
        self.sample_rounding(h, Some(self.collocation.h))?;
        Ok(self.shortest_resolved(h) < h)
    }

    /// Returns whether the last step contains a jump of a multiplier.
    pub(super) fn last_step_jumped(&self) -> bool {
        self.jump == Some([self.collocation.t0, 0.0])
    }

    /// Returns whether the multipliers of index 2 are smooth within the step.
    fn is_smooth_within(&mut self, h: f64) -> Result<bool, Failure> {
        // Internal variables are not available between the stages, and the fit requires three points.
        let is_possible = self.internal.is_none() && self.method.stages() > 2;
        if !is_possible || !self.multipliers.are_of_index_2() {
            return Ok(true);
        }
        let step = step_of!(self, h);
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let (solved, counters) = ((&self.newton.z[..], &self.algebraic[..]), &mut self.counters);
        let multipliers = &mut self.multipliers;
        match multipliers.measure_within(problem, matrices, &step, solved, counters) {
            Ok(()) => {}
            // F may be undefined between the stages.
            Err(Failure::Rejected(_)) => return Ok(true),
            Err(fatal) => return Err(fatal),
        }
        if self.unexplained(|_| 0.0) >= 1.0 {
            self.sample_rounding(h, (!self.fresh).then_some(self.collocation.h))?;
            if self.unexplained(|i| self.rounding.of(i)) >= 1.0 {
                return Ok(false);
            }
        }
        if self.fresh {
            // After a jump, the values at the start are unknown, so the errors measured within the step are always
            // used.
            let factor = if self.last_step_jumped() { 0.0 } else { DIFFERENT };
            let tolerance = |i| factor * self.weights.solution_tolerance(i);
            self.multipliers.use_within(&self.method, tolerance);
        }
        Ok(true)
    }

    /// Returns the largest error beyond `rounding`, in units of the limit above which a jump is assumed.
    fn unexplained(&self, rounding: impl Fn(usize) -> f64) -> f64 {
        let errors = self.multipliers.within(&self.method).map(|within| {
            let i = within.variable;
            let different = match self.fresh {
                true => 0.0,
                false => (within.difference - rounding(i)) / DIFFERENT,
            };
            let unexplained = (within.unexplained - rounding(i)) / UNEXPLAINED;
            self.error_test.mask()[i] * unexplained.max(different)
                / self.weights.solution_tolerance(i)
        });
        errors.fold(0.0, f64::max)
    }
}

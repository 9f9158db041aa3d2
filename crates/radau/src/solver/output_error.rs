//! Error test of dense output.

use myovib_dae::{LinearSolver, Problem, StopReason};

use super::state::{RadauSolver, step_of};
use crate::control::FACTORS;
use crate::failure::{Failure, Rejection};

/// Maximum error of dense output, in units of the tolerances, for methods with more than [`LOW_ORDER`] stages if dense
/// output is not used. A larger error indicates a kink or a pulse in a long step that the error estimate does not
/// detect. Errors of smooth steps and of Newton's method are usually smaller.
const UNUSED: f64 = 10.0;

/// Number of stages up to which the order of dense output is too low for this test. At tight tolerances, the test would
/// then limit smooth steps.
const LOW_ORDER: usize = 3;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Tests the error of dense output in variables of index 0 and 1. Returns the largest next step size that this
    /// error allows. Rounding is sampled only if the error exceeds the tolerances. The step passes in any case if
    /// multipliers would not be resolved in a shorter step.
    ///
    /// If dense output is not used, steps that follow a shortened step are not tested, because errors of Newton's
    /// method divided by the size of the shortened step may exceed the tolerances.
    pub(super) fn test_dense_output(&mut self, h: f64, iterations: usize) -> Result<f64, Failure> {
        let detects = self.options.detect_kinks && self.method.stages() > LOW_ORDER;
        let was_shortened = h > FACTORS.1 * self.collocation.h;
        let allowed = match self.interpolation.active {
            true => 1.0,
            false if detects && !was_shortened => UNUSED,
            false => return Ok(f64::INFINITY),
        };
        if !self.fresh {
            let (step, last) = (step_of!(self, h), &self.collocation);
            let at_start = (&self.y_dot[..], &self.algebraic[..]);
            self.interpolation.measure(&step, &self.newton.z, at_start, last);
        }
        let mut error = self.dense_output_error(|_| 0.0);
        if error >= allowed {
            self.sample_rounding(h, Some(self.collocation.h))?;
            error = self.dense_output_error(|i| self.rounding.of(i));
        }
        let proposal = self.control.propose(h, error / allowed, iterations);
        if error >= allowed && self.resolves_multipliers(h)? {
            return Err(Failure::Rejected(Rejection {
                reason: StopReason::ErrorTestFailures,
                message: format!("dense output error {error:.2e} times the tolerance at h = {h:e}"),
                step_factor: proposal / h,
            }));
        }
        Ok(proposal)
    }

    /// Returns the largest estimated error of dense output beyond `rounding` in variables of index 0 and 1, in units of
    /// the tolerances for the solution. Returns 0 in a first step.
    fn dense_output_error(&self, rounding: impl Fn(usize) -> f64) -> f64 {
        if self.fresh {
            return 0.0;
        }
        let mask = self.error_test.mask();
        let variables = (0..mask.len()).filter(|&i| self.multipliers.index(i) < 2);
        let beyond = |i| (self.interpolation.of(i) - rounding(i)).max(0.0);
        let errors = variables.map(|i| mask[i] * beyond(i) / self.weights.solution_tolerance(i));
        errors.fold(0.0, f64::max)
    }

    /// Returns the largest next step size for which the error of dense output in variables of index 2 is within the
    /// tolerances. Rounding errors are subtracted, and errors at the end of the step are added to the tolerances,
    /// because steps shortened at a jump would otherwise never grow again. Rounding is sampled only if the error would
    /// reduce the step size below `limit`. In systems of index 3, the step size is not limited, because rounding errors
    /// dominate.
    pub(super) fn limit_for_output_of_index_2(
        &mut self,
        h: f64,
        limit: f64,
    ) -> Result<f64, Failure> {
        let order = self.multipliers.order(self.method.stages());
        let Some(order) = order.filter(|_| self.multipliers.largest_index() == 2) else {
            return Ok(f64::INFINITY);
        };
        if !self.interpolation.active || self.fresh {
            return Ok(f64::INFINITY);
        }
        let (step, last) = (step_of!(self, h), &self.collocation);
        self.corrected.copy_from_slice(&self.newton.z);
        self.multipliers.remove_from_copy(&step, &mut self.corrected);
        let at_start = (&self.y_dot[..], &self.algebraic[..]);
        self.interpolation.measure(&step, &self.corrected, at_start, last);
        let proposal = self.propose_for_output_of_index_2(h, order, |_| 0.0);
        if proposal >= limit {
            return Ok(proposal);
        }
        self.sample_rounding(h, Some(self.collocation.h))?;
        Ok(self.propose_for_output_of_index_2(h, order, |i| self.rounding.of(i)))
    }

    /// Returns the largest next step size allowed by the measured error beyond `rounding`.
    fn propose_for_output_of_index_2(
        &self,
        h: f64,
        order: i32,
        rounding: impl Fn(usize) -> f64,
    ) -> f64 {
        let (step, mask) = (step_of!(self, h), self.error_test.mask());
        let at_end = self.multipliers.remaining_errors(&step, &self.collocation);
        let errors = at_end.map(|(i, at_end)| {
            let beyond = (self.interpolation.of(i) - rounding(i)).max(0.0);
            mask[i] * beyond / (self.weights.solution_tolerance(i) + at_end)
        });
        let error = errors.fold(0.0, f64::max);
        self.control.propose_for_multipliers(h, error, order)
    }
}

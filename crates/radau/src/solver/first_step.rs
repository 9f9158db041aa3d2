//! Size of the first step after a start.

use myovib_dae::{LinearSolver, Problem};

use super::state::{JacobianAge, RadauSolver};
use crate::failure::{Failure, Fatal};
use crate::options::StepSize;

/// Safety factor for the size of a first step. Without it, the sampled rounding errors of multipliers would be as large
/// as their tolerances. At high orders, some complex matrices amplify rounding errors more than the sampled matrix
/// does.
const SAFETY: f64 = 2.0;

/// Maximum fraction of the interval to which a first step may be lengthened in order to resolve multipliers.
const LARGEST_PART: f64 = 0.1;

/// Minimum of an estimated first step size, in units of the shortest step that rounding of t allows. It leaves a margin
/// for repetitions with smaller sizes.
const RESOLVED_T: f64 = 100.0;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Returns the size of the first step toward `t_out`; the step must not pass `limit`.
    pub(super) fn initial_step(&mut self, t_out: f64, limit: f64) -> Result<f64, Fatal> {
        if let StepSize::Fixed(h) = self.options.step_size {
            return Ok(h);
        }
        let (min, max) = (self.options.min_step, self.largest_step());
        if let Some(h) = self.options.initial_step {
            return Ok(h.max(min).min(max));
        }
        let resolved = RESOLVED_T * self.rounding_of_t();
        let h = self.estimated_first_step(t_out).max(min).max(resolved).min(max);
        match self.resolving_step(h) {
            Ok(resolving) => {
                let longest = LARGEST_PART * (t_out - self.t);
                Ok(h.max(resolving.min(longest).min(limit - self.t)).min(max))
            }
            // The step itself fails for the same reason and reports it.
            Err(Failure::Rejected(_)) => Ok(h),
            Err(Failure::Fatal(fatal)) => Err(fatal),
        }
    }

    /// Returns T τ^(3/4)/2 or a thousandth of the time to `t_out`, whichever is smaller. Here, τ is the relative
    /// tolerance of the estimate, and T is the time in which y changes by its own size, 1/(τ ‖ẏ‖) in the norm of the
    /// tolerances. In a step of size T τ/2, y would change by only half of the tolerance. Such a step may be so short
    /// that rounding errors dominate if there are constraints or ∂F/∂ẏ is singular.
    fn estimated_first_step(&self, t_out: f64) -> f64 {
        let squares = self.y_dot.iter().zip(self.weights.plain());
        let square: f64 = squares.map(|(v, w)| (v * w).powi(2)).sum();
        let of_y = (square / self.y.len() as f64).sqrt();
        let internal = self.internal.as_ref();
        let norm = of_y.hypot(internal.map_or(0.0, |internal| internal.rate(&self.method)));
        let accuracy = self.options.accuracy(&self.y);
        let relative = accuracy * self.options.internal_factor(accuracy);
        let scale = match relative > 0.0 {
            true => relative.powf(0.25),
            false => 1.0,
        };
        (1e-3 * (t_out - self.t)).min(0.5 / (norm * scale))
    }

    /// Returns the shortest first step in which the rounding errors of multipliers of index 3, amplified by 1/h², are
    /// within their tolerances. Returns 0 if there are no such multipliers. Rounding is sampled in a step of size `h`.
    fn resolving_step(&mut self, h: f64) -> Result<f64, Failure> {
        if self.multipliers.largest_index() < 3 {
            return Ok(0.0);
        }
        self.prepare_matrices(h)?;
        self.sample_rounding(h, None)?;
        // For the step itself, the Jacobian is evaluated and pivots are selected again.
        (self.jacobian, self.set_up_for, self.pivots_due) = (JacobianAge::Due, None, true);
        Ok(SAFETY * self.shortest_resolved(h))
    }

    /// Prepares an evaluation at the start of a step of size `h` with the matrices of this step.
    pub(super) fn prepare_matrices(&mut self, h: f64) -> Result<(), Failure> {
        if let Some(internal) = &mut self.internal {
            internal.begin(&mut self.problem, (&self.method, h), self.t, &self.y)?;
        }
        self.weights.scale(h);
        self.evaluate_jacobian(h)?;
        self.set_up(h)?;
        if let Some(internal) = &self.internal {
            internal.show_present(&mut self.problem);
        }
        Ok(())
    }

    /// Returns the shortest step in which the rounding errors of multipliers are within their tolerances, computed from
    /// the last sample of rounding in a step of size `h`. No safety factor is applied for variables of index 2, because
    /// it would exclude short steps that are needed after fast changes.
    pub(super) fn shortest_resolved(&self, h: f64) -> f64 {
        let (mask, largest_index) = (self.error_test.mask(), self.multipliers.largest_index());
        let excess = (0..mask.len()).map(|i| {
            let scale = mask[i] / self.weights.own_tolerance(i);
            match (self.multipliers.index(i), largest_index) {
                (3, _) => (scale * self.rounding.of(i)).sqrt(),
                (2, 2) => scale * self.rounding.sampled(i),
                _ => 0.0,
            }
        });
        h * excess.fold(0.0, f64::max)
    }
}

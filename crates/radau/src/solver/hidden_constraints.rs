//! Corrections of initial values that violate constraints by less than the tolerances.
//!
//! If a position constraint g(q) = 0 is violated by δ, a step of size h moves the positions by δ. The errors of
//! velocities and multipliers are then δ/h and δ/h². Therefore, steps fail even if δ is small, and shorter steps are
//! even more likely to fail. An error a of the velocities causes an error a/h of the multipliers, which no test
//! detects.

use myovib_dae::{LinearSolver, Problem};

use super::state::{RadauSolver, step_of};
use crate::failure::Failure;
use crate::newton::norm;

/// Maximum number of moves onto the constraints. Each move reduces a violation by a factor of about the relative size
/// of the violation.
const MOVES: usize = 8;

/// Relative rounding error of variables, below which violations are not reduced.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Maximum relative difference between velocity errors measured with two step sizes, up to which these errors are
/// attributed to the initial values. In contrast, errors of the steps are proportional to a power of h, and rounding
/// errors to 1/h.
const AGREEMENT: f64 = 0.2;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Moves variables of index 1 onto the constraints at the start of a first step of size `h`, if this changes them
    /// by less than the tolerances of the error test.
    pub(super) fn move_onto_constraints(&mut self, h: f64) -> Result<(), Failure> {
        if !self.multipliers.any() {
            return Ok(());
        }
        self.prepare_matrices(h)?;
        let (start, mut last) = (self.y.clone(), f64::INFINITY);
        for _ in 0..MOVES {
            match self.measure_constraints(h) {
                Ok(()) => {}
                // F may be undefined for other rates and multipliers.
                Err(Failure::Rejected(_)) => break,
                Err(fatal) => return Err(fatal),
            }
            let (weights, n) = (self.weights.plain(), self.y.len());
            let errors = self.multipliers.constraint_errors();
            let size = norm(errors.map(|(i, error)| error * weights[i]), n);
            // The moves stop converging when only rounding errors remain.
            let rounding = norm(start.iter().zip(weights).map(|(y, w)| ROUNDING * y * w), n);
            if !size.is_finite() || size > last {
                self.y.copy_from_slice(&start);
                break;
            }
            if size <= rounding || size > 0.5 * last {
                break;
            }
            self.remove_constraint_errors();
            let moves = self.y.iter().zip(&start).zip(self.weights.plain());
            let moved = norm(moves.map(|((y, start), w)| (y - start) * w), n);
            if moved.is_nan() || moved >= 1.0 {
                self.y.copy_from_slice(&start);
                break;
            }
            last = size;
        }
        Ok(())
    }

    /// Corrects the variables of index 1 so that they satisfy the constraints, from which they differ by the remaining
    /// error of Newton's method in the last step. `h` is the size of the step that has just failed.
    pub(super) fn return_to_constraints(&mut self, h: f64) -> Result<(), Failure> {
        let is_after_a_step = self.multipliers.any() && self.counters.statistics.steps > 0;
        if !is_after_a_step || self.set_up_for != Some(h) {
            return Ok(());
        }
        self.measure_constraints(h)?;
        self.remove_constraint_errors();
        Ok(())
    }

    fn measure_constraints(&mut self, h: f64) -> Result<(), Failure> {
        let step = step_of!(self, h);
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let (multipliers, counters) = (&mut self.multipliers, &mut self.counters);
        multipliers.measure_constraints(problem, matrices, &step, &self.y_dot, counters)
    }

    fn remove_constraint_errors(&mut self) {
        for (i, error) in self.multipliers.constraint_errors() {
            self.y[i] -= error;
        }
    }

    /// Removes the errors of velocities and of the derivatives of positions at the start of a first step, if two
    /// conditions are met: the error is larger than rounding errors, and it is about the same in the step just tested
    /// and in the step of half its size, whose errors and slopes are in `in_half`. Returns whether the initial values
    /// were changed.
    ///
    /// The derivative of the polynomial through positions on the constraints satisfies the hidden constraint up to an
    /// error of order h^s, even if the constraint depends on time.
    pub(super) fn correct_velocities(
        &mut self,
        h: f64,
        in_half: [&[f64]; 2],
    ) -> Result<bool, Failure> {
        let (weights, n) = (self.weights.plain(), self.y.len());
        let in_step = self.error_test.at_start();
        let size_of = |error: &dyn Fn(usize) -> f64| {
            let velocities = self.multipliers.velocities();
            norm(velocities.map(|i| weights[i] * error(i)), n)
        };
        let size = size_of(&|i| in_half[0][i]);
        let difference = size_of(&|i| in_half[0][i] - in_step[0][i]);
        if !(0.0 < size && size < 1.0) || difference > AGREEMENT * size {
            return Ok(false);
        }
        self.sample_rounding(h, None)?;
        let velocities = self.multipliers.velocities();
        let rounding = velocities.map(|i| self.weights.plain()[i] * self.rounding.of(i));
        if norm(rounding, n) > size {
            return Ok(false);
        }
        let in_step = self.error_test.at_start();
        let ratio = 1.0 / (2.0_f64.powi(self.method.stages() as i32) - 1.0);
        let [error, slope] =
            [0, 1].map(|k| move |i: usize| in_half[k][i] + ratio * (in_half[k][i] - in_step[k][i]));
        for i in self.multipliers.velocities() {
            self.y[i] += error(i);
        }
        for &i in self.multipliers.positions() {
            self.y_dot[i] = slope(i);
        }
        Ok(true)
    }
}

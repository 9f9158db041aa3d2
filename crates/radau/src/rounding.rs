//! What rounding does to a step.

use myovib_dae::{LinearSolver, Problem};

use crate::failure::{Failure, Operation};
use crate::newton::{Step, evaluate};
use crate::work::Counters;

/// Measures what units of rounding in t, y and ẏ become when Newton's matrix divides them by
/// powers of h:
///
/// ```text
/// ρ = (J_y + γ/h J_ẏ)⁻¹ [F(t + δt, y + δy, ẏ + δẏ) − F(t, y, ẏ)]
/// ```
///
/// with δ of one unit of rounding, once of one sign and once of changing signs, so that no sum
/// cancels both. A constraint of index 3 gives velocities ε|q|/h and multipliers ε|q|/h². No
/// correction and no estimate can be smaller, and a smaller step makes both larger: so what ρ
/// explains is no reason to reject a step.
#[derive(Debug)]
pub(crate) struct Rounding {
    y: Vec<f64>,
    y_dot: Vec<f64>,
    plain: Vec<f64>,
    change: Vec<f64>,
    /// |ρ|, summed over the samples.
    noise: Vec<f64>,
}

/// Errors up to this many times ρ are taken for rounding: the matrices of the other stages magnify
/// more than that of the real mode (twice at three stages, six times at seven, and so squared in
/// index 3), and an estimate sees the rounding of the shorter step before.
const MARGIN: f64 = 30.0;

impl Rounding {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
            plain: vec![0.0; n],
            change: vec![0.0; n],
            noise: vec![0.0; n],
        }
    }

    /// Measures ρ at the beginning of `step`, where the derivative is `y_dot`.
    pub(crate) fn measure<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        y_dot: &[f64],
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        evaluate(problem, step.t, step.y, y_dot, &mut self.plain, counters)?;
        self.noise.fill(0.0);
        for sign in [|_| 1.0, changing_sign] {
            for (i, (moved, y)) in self.y.iter_mut().zip(step.y).enumerate() {
                *moved = y * (1.0 + f64::EPSILON * sign(i));
            }
            for (i, (moved, v)) in self.y_dot.iter_mut().zip(y_dot).enumerate() {
                *moved = v * (1.0 - f64::EPSILON * sign(i));
            }
            let (t, change) = (step.t * (1.0 + f64::EPSILON), &mut self.change);
            evaluate(problem, t, &self.y, &self.y_dot, change, counters)?;
            for (change, plain) in change.iter_mut().zip(&self.plain) {
                *change -= plain;
            }
            counters.work.real_solves += 1;
            matrices
                .solve_real(problem, change)
                .map_err(Operation::LinearSolve.failed())?;
            for (noise, change) in self.noise.iter_mut().zip(change) {
                *noise += change.abs();
            }
        }
        Ok(())
    }

    /// What is left of an `error` of component i without rounding.
    pub(crate) fn beyond(&self, i: usize, error: f64) -> f64 {
        (error.abs() - self.of(i)).max(0.0)
    }

    /// What of an error of component i may be rounding.
    pub(crate) fn of(&self, i: usize) -> f64 {
        MARGIN * self.noise[i]
    }
}

/// Signs without a pattern that sums could cancel.
fn changing_sign(i: usize) -> f64 {
    let bits = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    match (bits >> 32).count_ones() % 2 {
        0 => 1.0,
        _ => -1.0,
    }
}

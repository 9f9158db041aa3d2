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
///
/// Under a hidden constraint ρ must not be missed before a step is repeated, and a unit in q may miss it:
/// g is rounded to units of its largest term, and may be the same for both. So there are two [`Sampling`]s.
#[derive(Debug)]
pub(crate) struct Rounding {
    /// The variables of index 2 and 3, whose rounding grows as steps get shorter.
    magnified: Vec<usize>,
    /// Whether one of them counts as if its rounding did not grow as fast: velocities of index 2 do. Then a
    /// step that fails by rounding fails the more, the shorter it is.
    grows: bool,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    plain: Vec<f64>,
    change: Vec<f64>,
    /// |ρ|, summed over two samples; twice the average of more.
    noise: Vec<f64>,
}

/// Errors up to this many times ρ are taken for rounding: the matrices of the other stages magnify
/// more than that of the real mode (twice at three stages, six times at seven, and so squared in
/// index 3), and an estimate sees the rounding of the shorter step before.
const MARGIN: f64 = 30.0;

/// How ρ is sampled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sampling {
    /// Units of rounding in δ.
    units: f64,
    samples: u64,
    /// Whether the rounding of the step before counts, in what this one begins with.
    with_start: bool,
}

impl Sampling {
    /// What is enough unless it explains nothing.
    const QUICK: Self = Self {
        units: 1.0,
        samples: 2,
        with_start: false,
    };

    /// What does not miss the rounding of a constraint.
    pub(crate) const THOROUGH: Self = Self {
        units: 4.0,
        samples: 8,
        with_start: true,
    };
}

impl Rounding {
    /// Of variables with these `indices`, whose errors count by these `powers` of h.
    pub(crate) fn new(indices: &[u8], powers: &[i32]) -> Self {
        let n = indices.len();
        let grows = |(&index, &power): (&u8, &i32)| i32::from(index) - 1 > power;
        Self {
            magnified: (0..n).filter(|&i| indices[i] > 1).collect(),
            grows: indices.iter().zip(powers).any(grows),
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
            plain: vec![0.0; n],
            change: vec![0.0; n],
            noise: vec![0.0; n],
        }
    }

    /// What to try, one after the other, before a step is repeated or shortened.
    pub(crate) fn samplings(&self) -> &'static [Sampling] {
        match self.grows {
            true => &[Sampling::QUICK, Sampling::THOROUGH],
            false => &[Sampling::QUICK],
        }
    }

    /// Measures ρ by a `sampling`, with the size of the step before, if there was one.
    pub(crate) fn sample<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        (y_dot, last): (&[f64], Option<f64>),
        sampling: Sampling,
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        evaluate(problem, step.t, step.y, y_dot, &mut self.plain, counters)?;
        self.noise.fill(0.0);
        let (unit, samples) = (sampling.units * f64::EPSILON, sampling.samples);
        for sample in 0..samples {
            for (i, (moved, y)) in self.y.iter_mut().zip(step.y).enumerate() {
                *moved = y * (1.0 + unit * sign(sample, i));
            }
            for (i, (moved, v)) in self.y_dot.iter_mut().zip(y_dot).enumerate() {
                *moved = v * (1.0 - unit * sign(sample, i));
            }
            let (t, change) = (step.t * (1.0 + unit), &mut self.change);
            evaluate(problem, t, &self.y, &self.y_dot, change, counters)?;
            for (change, plain) in change.iter_mut().zip(&self.plain) {
                *change -= plain;
            }
            counters.work.real_solves += 1;
            matrices
                .solve_real(problem, change)
                .map_err(Operation::LinearSolve.failed())?;
            for (noise, change) in self.noise.iter_mut().zip(change) {
                *noise += change.abs() * (2.0 / samples as f64);
            }
        }
        // The velocities that the step begins with have that of the step before, δ/h_last: h/h_last of what is
        // measured, in multipliers too.
        if let Some(last) = last.filter(|_| sampling.with_start) {
            for &i in &self.magnified {
                self.noise[i] *= 1.0 + step.h / last;
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

/// The sign of component i in a sample: all positive in the first, in others without a pattern that sums could
/// cancel.
fn sign(sample: u64, i: usize) -> f64 {
    let Some(later) = sample.checked_sub(1) else {
        return 1.0;
    };
    let bits = ((later << 32) + i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    match (bits >> 32).count_ones() % 2 {
        0 => 1.0,
        _ => -1.0,
    }
}

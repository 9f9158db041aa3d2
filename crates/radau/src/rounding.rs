//! Effects of rounding on a step.

use myovib_dae::{LinearSolver, Problem};

use crate::failure::{Failure, Operation};
use crate::newton::{Step, evaluate};
use crate::work::Counters;

/// Measures the effect of rounding t, y and ẏ, which Newton's matrix amplifies by powers of 1/h:
///
/// ```text
/// ρ = (J_y + γ/h J_ẏ)⁻¹ [F(t + δt, y + δy, ẏ + δẏ) − F(t, y, ẏ)]
/// ```
///
/// where δ is one rounding error. In one sample, all signs are equal; in the other, the signs vary, so that the terms
/// of a sum do not cancel in both samples. A constraint of index 3 causes errors ε|q|/h of velocities and ε|q|/h² of
/// multipliers. Corrections and estimates cannot be smaller than these rounding errors, which grow if the step size
/// decreases. Therefore, a step is not rejected because of errors up to ρ.
///
/// If there is a hidden constraint g(q) = 0, ρ must be known before a step is repeated. A change of q by one rounding
/// error may then be too small to change g, which is rounded to units of its largest term. Therefore, there are two
/// kinds of [`Sampling`].
#[derive(Debug)]
pub(crate) struct Rounding {
    /// Variables of index 2 and 3, whose rounding errors grow as steps get shorter.
    magnified: Vec<usize>,
    /// Whether the rounding error of any of these variables, for example of a velocity of index 2, grows faster with
    /// decreasing h than its tolerance. If so, a step that fails because of rounding also fails if it is shortened.
    grows: bool,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    plain: Vec<f64>,
    change: Vec<f64>,
    /// Sum of |ρ| over two samples; for more samples, twice the average.
    noise: Vec<f64>,
}

/// Multiple of ρ up to which errors are attributed to rounding. The matrices of the complex modes amplify rounding
/// errors more than the matrix of the real mode: twice as much for three stages, six times as much for seven stages,
/// and by the squares of these factors for index 3. Moreover, an estimate contains rounding errors of a shorter
/// previous step.
const MARGIN: f64 = 30.0;

/// Settings for sampling ρ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sampling {
    /// Size of δ in units of rounding.
    units: f64,
    samples: u64,
    /// Whether the rounding of the previous step is included in the initial values of this step.
    with_start: bool,
}

impl Sampling {
    /// Quick sampling, which is sufficient if it explains the error.
    const QUICK: Self = Self { units: 1.0, samples: 2, with_start: false };

    /// Sampling that detects the rounding of a constraint.
    pub(crate) const THOROUGH: Self = Self { units: 4.0, samples: 8, with_start: true };
}

impl Rounding {
    /// Creates the measurement for variables with the given `indices`, whose errors are scaled by the given `powers` of
    /// h.
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

    /// Returns the samplings to try, in this order, before a step is repeated or shortened.
    pub(crate) fn samplings(&self) -> &'static [Sampling] {
        match self.grows {
            true => &[Sampling::QUICK, Sampling::THOROUGH],
            false => &[Sampling::QUICK],
        }
    }

    /// Measures ρ by a `sampling`. `last` is the size of the previous step, if any.
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
            matrices.solve_real(problem, change).map_err(Operation::LinearSolve.failed())?;
            for (noise, change) in self.noise.iter_mut().zip(change) {
                *noise += change.abs() * (2.0 / samples as f64);
            }
        }
        // The initial velocities contain the rounding error δ/h_last of the previous step, which is h/h_last times the
        // measured rounding error. The same applies to multipliers.
        if let Some(last) = last.filter(|_| sampling.with_start) {
            for &i in &self.magnified {
                self.noise[i] *= 1.0 + step.h / last;
            }
        }
        Ok(())
    }

    /// Returns the part of an `error` of component i that exceeds rounding.
    pub(crate) fn beyond(&self, i: usize, error: f64) -> f64 {
        (error.abs() - self.of(i)).max(0.0)
    }

    pub(crate) fn sampled(&self, i: usize) -> f64 {
        self.noise[i]
    }

    /// Returns the error of component i that may be caused by rounding.
    pub(crate) fn of(&self, i: usize) -> f64 {
        MARGIN * self.noise[i]
    }
}

/// Returns the sign of component i in a sample. It is positive in the first sample and pseudorandom in the others, so
/// that terms do not cancel systematically.
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

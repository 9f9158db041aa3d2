//! Simplified Newton iterations for the stage equations.

use myovib_dae::{LinearSolver, Problem, StepError};

use crate::dense::write_combined;
use crate::failure::{Failure, Operation};
use crate::memory::Memory;
use crate::method::Method;
use crate::stage_system::StageSystem;
use crate::weights::Weights;
use crate::work::Counters;

/// How the iterations ended, short of an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Newton {
    /// Solved, after this many iterations; what more were spent on own errors, and to try new matrices,
    /// says nothing of h.
    Converged { iterations: usize },
    /// They diverge, or converge too slowly: this factor on h may help.
    Failed { step_factor: f64 },
}

/// What all iterations of a step share.
pub(crate) struct Step<'a> {
    pub(crate) method: &'a Method,
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) y: &'a [f64],
    /// Weights of the components in norms: the inverses of their tolerances.
    pub(crate) weights: &'a [f64],
}

/// Workspace and memory of Newton's method.
///
/// The unknowns are the stage increments z_i = Y_i − y_n; the equations
///
/// ```text
/// G_i(z) = F(t_n + c_i h, y_n + z_i, h⁻¹ Σ_j (A⁻¹)_ij z_j) = 0.
/// ```
#[derive(Debug)]
pub(crate) struct NewtonSolver {
    /// The stage increments, one after the other.
    pub(crate) z: Vec<f64>,
    /// The residuals of the stages; the corrections, once solved for.
    residuals: Vec<f64>,
    stage: Vec<f64>,
    stage_dot: Vec<f64>,
    system: StageSystem,
    /// The last correction of the last stage, which is that of the solution.
    correction: Vec<f64>,
    tolerance: f64,
    /// The part of the increments that their error may be.
    relative: f64,
    limit: usize,
    /// Whether a hidden constraint magnifies what is left by powers of 1/h: then a first correction is
    /// trusted no more than it is itself small.
    constrained: bool,
    /// θ/(1 − θ) for the first θ of the last step that had one: bounds the error that a first
    /// correction leaves.
    first_factor: f64,
    /// The last estimate of the contraction θ; 0 where one iteration was enough.
    pub(crate) contraction: f64,
    /// Whether the matrices come from difference quotients. At a wrong ẏ these may be wrong by orders of
    /// magnitude; Jacobians by formulas are trusted.
    by_differences: bool,
    /// Whether corrections by the matrices in use have been seen to contract.
    tried: bool,
    /// Largest norm of the last correction beyond rounding.
    allowed: f64,
    /// The norm of the increments.
    size: f64,
}

/// Above this contraction the iterations count as divergent.
const DIVERGENT: f64 = 0.99;

/// The own errors of variables that count less are not waited for once they fall by no better a
/// factor: rounding, divided by a power of h, may be all that is left of them.
const STALLED: f64 = 0.9;

/// The first correction of a step is not trusted to be better than this: the contraction may have
/// been better in the last step.
const LEAST_TRUST: f64 = 1e-3;

/// The part of ẏ that its error at the end of a step may be. Where a step is so short that y changes by
/// less than its tolerance, nothing else bounds it; and the next Jacobian is evaluated with it.
const RELATIVE: f64 = 0.01;

/// A step in which y changes by a smaller part of the tolerance of the error test is not resolved by it.
const RESOLVED: f64 = 0.1;

/// The slope at the end of a step that its increments explain is at most this times their mean slope.
const STEEP: f64 = 10.0;

/// New matrices are trusted once a correction is this part of the first.
const TRIED: f64 = 0.1;

/// Units of rounding of y that no correction of its increments resolves.
const ROUNDING: f64 = 100.0 * f64::EPSILON;

impl NewtonSolver {
    pub(crate) fn new(
        method: &Method,
        n: usize,
        tolerance: f64,
        limit: usize,
        constrained: bool,
    ) -> Self {
        let s = method.stages();
        // Largest change of h ẏ at the end per change of the increments.
        let slope: f64 = (0..s).map(|j| method.a_inverse(s - 1, j).abs()).sum();
        Self {
            z: vec![0.0; s * n],
            residuals: vec![0.0; s * n],
            stage: vec![0.0; n],
            stage_dot: vec![0.0; n],
            system: StageSystem::new(method, n),
            correction: vec![0.0; n],
            tolerance,
            relative: RELATIVE / slope,
            limit,
            constrained,
            first_factor: 1.0,
            contraction: 0.0,
            by_differences: false,
            tried: false,
            allowed: 0.0,
            size: 0.0,
        }
    }

    /// Iterates from the increments in `z`.
    ///
    /// With the contraction θ estimated from successive corrections, the error after a correction
    /// Δz is about θ/(1 − θ) ‖Δz‖; the iterations end when it is below the tolerance, or when θ
    /// says that it will not be within the iterations allowed (Hairer & Wanner IV.8). The own errors
    /// of variables that count less for the others get the iterations that are left while they fall.
    ///
    /// New matrices by difference quotients are tested with two corrections at least, since entries that
    /// are far too large make any first correction small. And the error is bounded by a part of the increments too: F may depend on
    /// ẏ in any way, and a tolerance for y alone leaves ẏ an error of tolerance/h.
    ///
    /// Two corrections do not show that the iterations diverge. In index 3 the first one, from a
    /// start at rest, moves positions by h v; what is quadratic in it, h² v², comes back as
    /// corrections h² v²/h of the velocity: as large as the first, however small h.
    pub(crate) fn solve<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        mut memory: Option<&mut Memory<P>>,
        step: &Step<'_>,
        weights: &Weights<P>,
        counters: &mut Counters,
    ) -> Result<Newton, Failure> {
        // As in RADAU5: what the last step found is trusted less for this one.
        self.first_factor = self.first_factor.max(LEAST_TRUST).powf(0.8);
        self.contraction = 0.0;
        let mut error_factor = if self.constrained {
            1.0
        } else {
            self.first_factor
        };
        let of_y = norm(
            step.y.iter().zip(step.weights).map(|(y, w)| y * w),
            step.y.len(),
        );
        let mut first_norm = 0.0;
        let mut last_norm = 0.0;
        let mut last_ratio = 0.0;
        let mut last_own = f64::INFINITY;
        let mut solved_after = None;
        for iteration in 1..=self.limit {
            counters.statistics.newton_iterations += 1;
            if let Some(memory) = &mut memory {
                self.drive(problem, memory, step)?;
            }
            self.evaluate_residuals(problem, memory.as_deref(), step, counters)?;
            let [norm, size] = self.correct(problem, matrices, step, counters)?;
            let tolerance = match self.by_differences {
                true => (self.tolerance).min((self.relative * size).max(ROUNDING * of_y)),
                false => self.tolerance,
            };
            self.allowed = if self.tried { tolerance } else { 0.0 };
            self.size = size;
            if !norm.is_finite() {
                return Ok(Newton::Failed { step_factor: 0.5 });
            }
            if iteration > 1 && !self.tried {
                self.tried = norm <= TRIED * first_norm;
                solved_after = solved_after.filter(|_| self.tried);
            }
            if iteration > 1 && solved_after.is_none() {
                let ratio = norm / last_norm;
                self.contraction = match iteration {
                    2 => ratio,
                    _ => f64::sqrt(ratio * last_ratio),
                };
                last_ratio = ratio;
                if iteration > 2 && self.contraction >= DIVERGENT {
                    return Ok(Newton::Failed { step_factor: 0.5 });
                }
                let contraction = self.contraction.min(DIVERGENT);
                error_factor = contraction / (1.0 - contraction);
                if iteration == 2 {
                    self.first_factor = error_factor;
                }
                let left = (self.limit - iteration) as i32;
                let at_limit = error_factor * norm * contraction.powi(left);
                // The step that would do with the iterations left, by RADAU5's rule.
                if iteration > 2 && at_limit > tolerance {
                    let excess = (at_limit / tolerance).min(20.0);
                    let exponent = -1.0 / f64::from(left + 4);
                    return Ok(Newton::Failed {
                        step_factor: 0.8 * excess.powf(exponent),
                    });
                }
            }
            if solved_after.is_none() && error_factor * norm <= tolerance {
                solved_after = Some(iteration);
            }
            let own = weights.largest_own(|i| self.correction[i]);
            let own_solved = error_factor * own <= self.tolerance || own > STALLED * last_own;
            let enough = self.tried && own_solved || iteration == self.limit;
            if let Some(iterations) = solved_after.filter(|_| enough) {
                return Ok(Newton::Converged { iterations });
            }
            if iteration == 1 {
                first_norm = norm;
            }
            last_own = own;
            last_norm = norm.max(f64::EPSILON);
        }
        Ok(Newton::Failed { step_factor: 0.5 })
    }

    /// Whether corrections by the matrices in use have been seen to contract.
    pub(crate) fn has_tried_matrices(&self) -> bool {
        self.tried
    }

    /// Takes note of new matrices, which come from difference quotients or from formulas.
    pub(crate) fn renew_matrices(&mut self, by_differences: bool) {
        self.by_differences = by_differences;
        self.tried = !by_differences;
    }

    /// Sets whether corrections by the matrices in use have been seen to contract.
    pub(crate) fn set_tried(&mut self, tried: bool) {
        self.tried = tried;
    }

    /// What is kept between steps.
    pub(crate) fn memory(&self) -> [f64; 2] {
        [self.first_factor, self.contraction]
    }

    /// Goes on with this [`memory`](Self::memory).
    pub(crate) fn restore(&mut self, memory: [f64; 2]) {
        [self.first_factor, self.contraction] = memory;
    }

    /// Sets the norm below which the error of the solution counts as none.
    pub(crate) fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// The norm that the last correction may have beyond rounding: 0 by matrices that have not been tried.
    pub(crate) fn allowed(&self) -> f64 {
        self.allowed
    }

    /// Returns whether ẏ changes abruptly over the step, by more than rounding of y explains: by more
    /// than its size where y changes by a fraction of its tolerance only, or far more steeply than y.
    pub(crate) fn leaps(&mut self, step: &Step<'_>, y_dot: &[f64]) -> bool {
        if !self.by_differences {
            return false;
        }
        let n = step.y.len();
        let last = step.method.stages() - 1;
        let slope = |_, j| step.method.a_inverse(last, j) / step.h;
        write_combined(&mut self.stage_dot, n, slope, &self.z);
        let changes = self.stage_dot.iter().zip(y_dot).zip(step.weights);
        let change = norm(changes.map(|((new, old), w)| (new - old) * w), n);
        let weighted = |x: &[f64]| norm(x.iter().zip(step.weights).map(|(x, w)| x * w), n);
        let before = weighted(y_dot);
        let unresolved = self.size <= RESOLVED && change > before;
        let steep = change > STEEP * before.max(self.size / step.h);
        (unresolved || steep) && change > ROUNDING * weighted(step.y) / step.h.abs()
    }

    /// The last correction of the solution.
    pub(crate) fn correction(&self) -> &[f64] {
        &self.correction
    }

    /// Evaluates the drives of a `memory` at all stages.
    pub(crate) fn drive<P: Problem>(
        &mut self,
        problem: &mut P,
        memory: &mut Memory<P>,
        step: &Step<'_>,
    ) -> Result<(), Failure> {
        for (i, c) in step.method.nodes().iter().enumerate() {
            self.move_to(i, step);
            memory.drive(problem, i, (step.t + c * step.h, &self.stage))?;
        }
        Ok(())
    }

    /// Writes y at stage i.
    fn move_to(&mut self, i: usize, step: &Step<'_>) {
        let n = step.y.len();
        let increments = step.y.iter().zip(&self.z[i * n..(i + 1) * n]);
        for (stage, (y, z)) in self.stage.iter_mut().zip(increments) {
            *stage = y + z;
        }
    }

    fn evaluate_residuals<P: Problem>(
        &mut self,
        problem: &mut P,
        memory: Option<&Memory<P>>,
        step: &Step<'_>,
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let n = step.y.len();
        for (i, c) in step.method.nodes().iter().enumerate() {
            self.move_to(i, step);
            if let Some(memory) = memory {
                memory.show_stage(problem, i, (step.method, step.h));
            }
            let slope = |_, j| step.method.a_inverse(i, j) / step.h;
            write_combined(&mut self.stage_dot, n, slope, &self.z);
            let residual = &mut self.residuals[i * n..(i + 1) * n];
            let (t, y, v) = (step.t + c * step.h, &self.stage, &self.stage_dot);
            evaluate(problem, t, y, v, residual, counters)?;
        }
        Ok(())
    }

    /// Solves for the correction, adds it to `z`, and returns the norms of both.
    fn correct<P, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        counters: &mut Counters,
    ) -> Result<[f64; 2], Failure> {
        let corrections = &mut self.residuals;
        corrections.iter_mut().for_each(|g| *g = -*g);
        self.system
            .solve(problem, matrices, step.method, corrections, counters)
            .map_err(Operation::LinearSolve.failed())?;
        let n = step.y.len();
        let mut squares = [0.0, 0.0];
        for (z, correction) in self.z.chunks_exact_mut(n).zip(corrections.chunks_exact(n)) {
            for ((z, correction), w) in z.iter_mut().zip(correction).zip(step.weights) {
                *z += correction;
                squares[0] += (correction * w).powi(2);
                squares[1] += (*z * w).powi(2);
            }
        }
        let last = corrections.len() - n;
        self.correction.copy_from_slice(&corrections[last..]);
        Ok(squares.map(|square| (square / self.z.len() as f64).sqrt()))
    }
}

/// The root mean square of `n` numbers.
pub(crate) fn norm(of: impl Iterator<Item = f64>, n: usize) -> f64 {
    (of.map(|x| x * x).sum::<f64>() / n as f64).sqrt()
}

/// Evaluates the residual; one that is not finite is a recoverable error.
pub(crate) fn evaluate<P: Problem>(
    problem: &mut P,
    t: f64,
    y: &[f64],
    y_dot: &[f64],
    residual: &mut [f64],
    counters: &mut Counters,
) -> Result<(), Failure> {
    counters.statistics.residual_evaluations += 1;
    problem
        .residual(t, y, y_dot, residual)
        .and_then(|()| expect_finite(t, residual))
        .map_err(Operation::Residual.failed())
}

fn expect_finite(t: f64, residual: &[f64]) -> Result<(), StepError> {
    match residual.iter().position(|r| !r.is_finite()) {
        None => Ok(()),
        Some(i) => {
            let value = residual[i];
            let message = format!("residual[{i}] = {value} at t = {t}");
            Err(StepError::Recoverable(message))
        }
    }
}

//! Simplified Newton iterations for the stage equations.

use myovib_dae::{LinearSolver, Problem, StepError};

use crate::dense::write_combined;
use crate::failure::{Failure, Operation};
use crate::internal_variables::EliminatedVariables;
use crate::method::Method;
use crate::stage_system::StageSystem;
use crate::weights::Weights;
use crate::work::Counters;

/// Result of the iterations, unless an error occurred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Newton {
    /// Converged after this number of iterations. Additional iterations for unscaled errors and for the test of new
    /// matrices are not counted, because they do not indicate that h is too large.
    Converged { iterations: usize },
    /// The iterations diverged or converged too slowly. The step should be repeated with h multiplied by this factor.
    Failed { step_factor: f64 },
}

/// Data shared by all iterations of a step.
pub(crate) struct Step<'a> {
    pub(crate) method: &'a Method,
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) y: &'a [f64],
    /// Weights of the components in norms: the reciprocals of the tolerances.
    pub(crate) weights: &'a [f64],
}

/// Workspace and state of Newton's method.
///
/// The unknowns are the stage increments z_i = Y_i − y_n. The equations are
///
/// ```text
/// G_i(z) = F(t_n + c_i h, y_n + z_i, h⁻¹ Σ_j (A⁻¹)_ij z_j) = 0.
/// ```
#[derive(Debug)]
pub(crate) struct NewtonSolver {
    /// Stage increments, stage by stage.
    pub(crate) z: Vec<f64>,
    /// Residuals of the stages, replaced by the corrections in the solve.
    residuals: Vec<f64>,
    stage: Vec<f64>,
    stage_dot: Vec<f64>,
    system: StageSystem,
    /// Last correction of the last stage, which is the correction of the solution.
    correction: Vec<f64>,
    tolerance: f64,
    /// Maximum error relative to the increments.
    relative: f64,
    limit: usize,
    /// Whether a hidden constraint amplifies the remaining error by powers of 1/h. If so, the error after the first
    /// correction is assumed to be as large as the correction.
    constrained: bool,
    /// θ/(1 − θ) for the first θ that was measured in the last step, which bounds the error after the first correction.
    first_factor: f64,
    /// Last estimate of the contraction θ, or 0 if one iteration was sufficient.
    pub(crate) contraction: f64,
    /// Whether errors are also bounded relative to the increments, and new matrices are tested. Both are necessary for
    /// difference quotients, which may be wrong by orders of magnitude if ẏ is wrong, and for dense output, whose error
    /// estimate contains the errors of Newton's method.
    strict: bool,
    /// Whether contractions after [`LONG`] corrections must be confirmed.
    confirms: bool,
    /// Whether the corrections have contracted with the current matrices.
    tried: bool,
    /// Norm up to which the last correction is attributed to rounding.
    allowed: f64,
    /// Norm of the increments.
    size: f64,
}

/// Contraction above which the iterations are considered divergent.
const DIVERGENT: f64 = 0.99;

/// Contraction of the unscaled errors of variables with reduced weights above which the additional iterations for these
/// errors stop, because the remaining errors may be rounding errors divided by a power of h.
const STALLED: f64 = 0.9;

/// Lower bound for the contraction assumed for the first correction of a step, because the contraction of the last step
/// may have been better.
const LEAST_TRUST: f64 = 1e-3;

/// Maximum relative error of ẏ at the end of a step. If a step is so short that y changes by less than its tolerance,
/// no other condition bounds this error, although the next Jacobian is evaluated at this ẏ.
const RELATIVE: f64 = 0.01;

/// Fraction of the tolerance below which the error test does not detect changes of y in a step.
const RESOLVED: f64 = 0.1;

/// Maximum plausible ratio of the slope at the end of a step to the mean slope of the increments.
const STEEP: f64 = 10.0;

/// Maximum ratio of the last correction to the first for which new matrices are considered tested.
const TRIED: f64 = 0.1;

/// Maximum size of the last correction in all iterations except the first, as a fraction of the solution. Corrections
/// up to the tolerance are always allowed.
const SMALL: f64 = 0.01;

/// Norm of a correction, in units of the tolerance, above which the contraction estimated from this correction and the
/// next one must be confirmed.
const LONG: f64 = 10.0;

/// Relative size below which corrections may consist of rounding errors, which do not contract, if the matrices are
/// ill-conditioned.
const UNRESOLVED: f64 = 1e4 * f64::EPSILON;

/// Relative rounding error of y, below which corrections of the increments are not resolved.
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
        // Largest change of h ẏ at the end of the step for a unit change of the increments.
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
            strict: false,
            confirms: false,
            tried: false,
            allowed: 0.0,
            size: 0.0,
        }
    }

    /// Iterates from the increments in `z`.
    ///
    /// The contraction θ is estimated from successive corrections. The error after a correction Δz is about θ/(1 − θ)
    /// ‖Δz‖. The iterations end when this error is below the tolerance, or when θ predicts that the error cannot reach
    /// the tolerance within the allowed number of iterations (Hairer & Wanner IV.8). The remaining iterations are used
    /// for the unscaled errors of variables with reduced weights, as long as these errors decrease.
    ///
    /// New matrices from difference quotients are tested with at least two corrections, because the first correction is
    /// always small if entries are much too large. The error is also bounded relative to the increments: a tolerance
    /// for y alone allows an error of tolerance/h in ẏ, on which F may depend in any way.
    ///
    /// Two corrections are not sufficient to detect divergence. For index 3 and a start at rest, the first correction
    /// changes positions by h v. The quadratic terms h² v² of the constraints then lead to corrections h² v²/h of the
    /// velocity. These are proportional to h, as is the first correction, even if h is very small.
    ///
    /// Two corrections are also not sufficient to detect convergence if the first exceeds [`LONG`] and crosses a kink
    /// of F, such as the threshold of an ideal diode. With the matrices of the other branch, the second correction may
    /// be small although the third is not.
    pub(crate) fn solve<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        mut internal: Option<&mut EliminatedVariables<P>>,
        step: &Step<'_>,
        weights: &Weights<P>,
        counters: &mut Counters,
    ) -> Result<Newton, Failure> {
        // As in RADAU5, the contraction of the last step is used, increased for safety.
        self.first_factor = self.first_factor.max(LEAST_TRUST).powf(0.8);
        self.contraction = 0.0;
        let mut error_factor = if self.constrained { 1.0 } else { self.first_factor };
        let of_y = norm(step.y.iter().zip(step.weights).map(|(y, w)| y * w), step.y.len());
        let mut first_norm = 0.0;
        let mut last_norm = 0.0;
        let mut last_ratio = 0.0;
        let mut last_own = f64::INFINITY;
        let mut solved_after = None;
        let mut is_unconfirmed = false;
        for iteration in 1..=self.limit {
            counters.statistics.newton_iterations += 1;
            if let Some(internal) = &mut internal {
                self.evaluate_driving_quantities(problem, internal, step)?;
            }
            self.evaluate_residuals(problem, internal.as_deref(), step, counters)?;
            let [norm, size] = self.correct(problem, matrices, step, counters)?;
            let tolerance = match self.strict {
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
                // Step size for which the remaining iterations would suffice, by the rule of RADAU5.
                if iteration > 2 && at_limit > tolerance {
                    let excess = (at_limit / tolerance).min(20.0);
                    let exponent = -1.0 / f64::from(left + 4);
                    return Ok(Newton::Failed { step_factor: 0.8 * excess.powf(exponent) });
                }
            }
            // The contraction is not reliable if it is measured from a correction that has diverged, so later
            // corrections must also be small. At rest, the size of the solution is unknown.
            let is_small = iteration == 1 || of_y == 0.0 || norm <= (SMALL * of_y).max(1.0);
            if solved_after.is_none() && is_small && error_factor * norm <= tolerance {
                solved_after = Some(iteration);
            }
            let is_rounding = norm <= UNRESOLVED * (of_y + size);
            if solved_after == Some(iteration) {
                is_unconfirmed = self.confirms && iteration > 1 && last_norm > LONG;
            } else if std::mem::take(&mut is_unconfirmed) && !is_rounding {
                let ratio = norm / last_norm;
                if ratio >= DIVERGENT {
                    self.allowed = 0.0;
                    return Ok(Newton::Failed { step_factor: 0.5 });
                }
                if ratio / (1.0 - ratio) * norm > tolerance {
                    (solved_after, last_ratio) = (None, ratio);
                }
            }
            let own = weights.largest_own(|i| self.correction[i]);
            let own_solved = error_factor * own <= self.tolerance || own > STALLED * last_own;
            let enough = self.tried && own_solved && !is_unconfirmed || iteration == self.limit;
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

    /// Returns whether the corrections have contracted with the current matrices.
    pub(crate) fn has_tried_matrices(&self) -> bool {
        self.tried
    }

    /// Sets whether errors are bounded relative to the increments and new matrices are tested. If matrices are computed
    /// `by_differences`, contractions after long corrections are also confirmed.
    pub(crate) fn set_strict(&mut self, strict: bool, by_differences: bool) {
        (self.strict, self.confirms) = (strict, by_differences);
        self.tried |= !strict;
    }

    /// Sets whether the corrections have contracted with the current matrices.
    pub(crate) fn set_tried(&mut self, tried: bool) {
        self.tried = tried;
    }

    /// Returns the state stored between steps.
    pub(crate) fn saved(&self) -> [f64; 2] {
        [self.first_factor, self.contraction]
    }

    /// Restores the state returned by [`saved`](Self::saved).
    pub(crate) fn restore(&mut self, saved: [f64; 2]) {
        [self.first_factor, self.contraction] = saved;
    }

    /// Sets the norm below which the error of the solution is neglected.
    pub(crate) fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Returns the norm up to which the last correction is attributed to rounding. Returns 0 if the matrices have not
    /// been tested.
    pub(crate) fn allowed(&self) -> f64 {
        self.allowed
    }

    /// Returns whether ẏ changes abruptly over the step and by more than rounding of y can cause. A change is abrupt if
    /// it exceeds ẏ although y changes by only a fraction of its tolerance, or if it is much larger than both ẏ and the
    /// mean slope of y in the step. Derivatives of `free` variables may change abruptly.
    pub(crate) fn leaps(&mut self, step: &Step<'_>, y_dot: &[f64], free: &[usize]) -> bool {
        if !self.strict {
            return false;
        }
        let n = step.y.len();
        let last = step.method.stages() - 1;
        let slope = |_, j| step.method.a_inverse(last, j) / step.h;
        write_combined(&mut self.stage_dot, n, slope, &self.z);
        for &i in free {
            self.stage_dot[i] = y_dot[i];
        }
        let changes = self.stage_dot.iter().zip(y_dot).zip(step.weights);
        let change = norm(changes.map(|((new, old), w)| (new - old) * w), n);
        let weighted = |x: &[f64]| norm(x.iter().zip(step.weights).map(|(x, w)| x * w), n);
        let before = weighted(y_dot);
        let unresolved = self.size <= RESOLVED && change > before;
        let steep = change > STEEP * before.max(self.size / step.h);
        (unresolved || steep) && change > ROUNDING * weighted(step.y) / step.h.abs()
    }

    /// Returns the norm of the increments.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// Returns the last correction of the solution.
    pub(crate) fn correction(&self) -> &[f64] {
        &self.correction
    }

    /// Evaluates the driving quantities of internal variables at all stages.
    pub(crate) fn evaluate_driving_quantities<P: Problem>(
        &mut self,
        problem: &mut P,
        internal: &mut EliminatedVariables<P>,
        step: &Step<'_>,
    ) -> Result<(), Failure> {
        for (i, c) in step.method.nodes().iter().enumerate() {
            self.move_to(i, step);
            internal.evaluate_driving_quantity(problem, i, (step.t + c * step.h, &self.stage))?;
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
        internal: Option<&EliminatedVariables<P>>,
        step: &Step<'_>,
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let n = step.y.len();
        for (i, c) in step.method.nodes().iter().enumerate() {
            self.move_to(i, step);
            if let Some(internal) = internal {
                internal.show_stage(problem, i, (step.method, step.h));
            }
            let slope = |_, j| step.method.a_inverse(i, j) / step.h;
            write_combined(&mut self.stage_dot, n, slope, &self.z);
            let residual = &mut self.residuals[i * n..(i + 1) * n];
            let (t, y, v) = (step.t + c * step.h, &self.stage, &self.stage_dot);
            evaluate(problem, t, y, v, residual, counters)?;
        }
        Ok(())
    }

    /// Solves for the correction, adds it to `z`, and returns the norms of the correction and of `z`.
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

/// Returns the root mean square of `n` numbers.
pub(crate) fn norm(of: impl Iterator<Item = f64>, n: usize) -> f64 {
    (of.map(|x| x * x).sum::<f64>() / n as f64).sqrt()
}

/// Evaluates the residual. A non-finite residual is a recoverable error.
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
        .and_then(|()| expect_finite("residual", t, residual))
        .map_err(Operation::Residual.failed())
}

/// Returns a recoverable error if one of the `values` of a function is not finite.
pub(crate) fn expect_finite(name: &str, t: f64, values: &[f64]) -> Result<(), StepError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(i) => Err(StepError::Recoverable(format!("{name}[{i}] = {} at t = {t}", values[i]))),
    }
}

//! Error of multipliers computed by collocation, and removal of this error.

mod within;

use myovib_dae::{LinearSolver, Problem, VariableKind};
use serde::{Deserialize, Serialize};

use crate::dense::Collocation;
use crate::failure::{Failure, Operation};
use crate::method::Method;
use crate::newton::{Step, evaluate};
use crate::work::Counters;

/// Removes the leading error of algebraic variables of index 2 and 3, and monitors the error of velocities that a
/// hidden constraint determines.
///
/// Consider q̇ = v, v̇ = λ with the constraint 0 = q − g(t). Radau IIA yields the exact q at 0, c_1, …, c_s. The
/// computed values of v are derivatives of the polynomial u through these values of q. Their errors at the nodes are
/// −ω'(θ) ε, where q − u = h ε ω to leading order. Let a be the error of the initial v. The error of λ is
///
/// ```text
/// (ℓ_0'(θ) (a + ε) − ω''(θ) ε)/h,   ω = θ ℓ_0,   ℓ_0 = Π (1 − θ/c_i).
/// ```
///
/// To leading order, a general multiplier of index 3 has the same error, and a multiplier of index 2 has the error
/// −ω'(θ) ε. (The part of the velocities that the constraint determines also has this error.) The order of this error
/// is at most s + 2 minus the index, and much lower after a change of h. The variables of index 1 determine both parts
/// of the error. The first part, −(a + ε), is u'(t_n) − ẏ_n. The second part, ε, is the difference between the
/// polynomial and the solution at the start of the last step, divided by h ω at this point. The iteration matrix
/// converts both parts to errors of multipliers:
///
/// ```text
/// e(x) = −(J_y + γ/h J_ẏ)⁻¹ (F(t_n, y_n, ẏ_n + x) − F(t_n, y_n, ẏ_n))
/// ```
///
/// is x for multipliers of index 2, and γ x/h for multipliers of index 3. The removal of the error does not change the
/// steps, because the stage equations do not contain the initial multipliers.
#[derive(Debug)]
pub(crate) struct Multipliers {
    list: Vec<Multiplier>,
    indices: Vec<u8>,
    /// Values added to the multipliers of the last step, stage by stage.
    removed: Vec<f64>,
    /// Differential variables of index 1.
    free: Vec<usize>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    plain: Vec<f64>,
    residual: Vec<f64>,
    /// Errors of all multipliers between the stages, point by point.
    between: Vec<f64>,
}

/// Errors of a multiplier or of a velocity of index 2.
#[derive(Debug, Clone)]
struct Multiplier {
    variable: usize,
    index: u8,
    /// Whether the error can be removed. The next step uses the velocities as initial values, but not the multipliers.
    removable: bool,
    known: PreviousMultipliers,
    /// e(ε) of the current step.
    missed: f64,
    /// e(−(a + ε)) of the current step.
    jump: f64,
    /// e(ε) and the unexplained part of the residual, measured within the current step.
    within: [f64; 2],
}

/// State of a multiplier stored from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct PreviousMultipliers {
    /// Collocation value at the end of the last step.
    raw: f64,
    /// Value of e(ε) in the last step.
    last: f64,
    /// Whether the change of e(ε) is consistent with rounding errors.
    #[serde(default)]
    noisy: bool,
}

impl PreviousMultipliers {
    pub(crate) fn numbers(&self) -> [f64; 2] {
        [self.raw, self.last]
    }
}

/// Assumed ratio of the remaining error to the change of the removed error, estimated from the coefficients of
/// successive orders.
const MARGIN: f64 = 2.0;

/// Factor of the displacements with which equations that contain certain variables are detected. It is small, because
/// equations may be undefined far from the state.
const SMALL: f64 = 1e-3;

/// Minimum ratio of step sizes for which the change of e(ε) can be distinguished from rounding.
const TELLING: f64 = 1.2;

/// Ratio a/ε, predicted from the step sizes, below which ε is computed from a + ε instead of from the last step.
const SHORT: f64 = 0.1;

impl Multipliers {
    pub(crate) fn new(kinds: &[VariableKind], indices: &[u8], y: &[f64]) -> Self {
        let n = y.len();
        let algebraic = |i: usize| kinds[i] == VariableKind::Algebraic;
        let multiplier = |variable| Multiplier {
            variable,
            index: indices[variable],
            removable: algebraic(variable),
            known: PreviousMultipliers { raw: y[variable], last: 0.0, noisy: false },
            missed: 0.0,
            jump: 0.0,
            within: [0.0; 2],
        };
        let of_higher_index = (0..n).filter(|&i| indices[i] > 1);
        let list: Vec<_> = of_higher_index.map(multiplier).collect();
        let zeros = vec![0.0; if list.is_empty() { 0 } else { n }];
        Self {
            free: (0..n).filter(|&i| !algebraic(i) && indices[i] <= 1).collect(),
            list,
            indices: indices.to_vec(),
            removed: Vec::new(),
            y: zeros.clone(),
            y_dot: zeros.clone(),
            plain: zeros.clone(),
            residual: zeros,
            between: Vec::new(),
        }
    }

    pub(crate) fn largest_index(&self) -> u8 {
        self.indices.iter().copied().max().unwrap_or(0)
    }

    /// Returns the index of variable i.
    pub(crate) fn index(&self, i: usize) -> u8 {
        self.indices[i]
    }

    /// Returns whether there are multipliers, in which case a hidden constraint amplifies errors by powers of 1/h.
    pub(crate) fn any(&self) -> bool {
        !self.list.is_empty()
    }

    /// Returns the lowest order of the remaining errors, or `None` if there are no multipliers.
    pub(crate) fn order(&self, stages: usize) -> Option<i32> {
        let orders = self.list.iter().map(|multiplier| {
            let gained = i32::from(multiplier.removable);
            multiplier.power(stages) + gained
        });
        orders.min()
    }

    /// Returns the state stored from step to step.
    pub(crate) fn known(&self) -> Vec<PreviousMultipliers> {
        self.list.iter().map(|multiplier| multiplier.known).collect()
    }

    /// Restores the state returned by [`known`](Self::known).
    pub(crate) fn restore(&mut self, known: &[PreviousMultipliers]) {
        for (multiplier, known) in self.list.iter_mut().zip(known) {
            multiplier.known = *known;
        }
    }

    /// Restarts from the consistent values `y`.
    pub(crate) fn restart(&mut self, y: &[f64]) {
        for multiplier in &mut self.list {
            multiplier.known.raw = y[multiplier.variable];
        }
    }

    /// Measures both parts of the error of the step with increments `z`. The step starts with the derivative `y_dot` at
    /// the end of the step `before`, if such a step exists.
    pub(crate) fn measure<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        before: Option<&Collocation>,
        (y_dot, z): (&[f64], &[f64]),
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let (n, method) = (step.y.len(), step.method);
        self.y.copy_from_slice(step.y);
        for multiplier in self.list.iter().filter(|multiplier| multiplier.removable) {
            self.y[multiplier.variable] = multiplier.known.raw;
        }
        evaluate(problem, step.t, &self.y, y_dot, &mut self.plain, counters)?;

        self.y_dot.copy_from_slice(y_dot);
        for &i in &self.free {
            let z_i = z[i..].iter().step_by(n).enumerate();
            let slope: f64 = z_i.map(|(j, z)| method.basis_derivative(j, 0.0) * z).sum();
            self.y_dot[i] = slope / step.h;
        }
        self.solve(problem, matrices, step, counters)?;
        for multiplier in &mut self.list {
            multiplier.jump = -self.residual[multiplier.variable];
        }

        let ratio = before.map_or(0.0, |before| (step.t - before.t0) / step.h);
        let a_over_epsilon = method.stages() as f64 * ratio.powi(method.stages() as i32);
        for multiplier in &mut self.list {
            multiplier.missed = -multiplier.jump / (1.0 + a_over_epsilon);
        }
        let Some(before) = before else {
            return Ok(());
        };
        if a_over_epsilon >= SHORT {
            self.y_dot.copy_from_slice(y_dot);
            let omega = -ratio * method.start_basis(0, -ratio);
            for &i in &self.free {
                let z_i = z[i..].iter().step_by(n).enumerate();
                let change: f64 = z_i.map(|(j, z)| method.basis(j, -ratio) * z).sum();
                self.y_dot[i] += (before.y0[i] - step.y[i] - change) / (omega * step.h);
            }
            self.solve(problem, matrices, step, counters)?;
            for multiplier in &mut self.list {
                multiplier.missed = -self.residual[multiplier.variable];
            }
        }
        let growth = step.h / before.h;
        for multiplier in &mut self.list {
            multiplier.known.noisy = multiplier.changes_like_rounding(method.stages(), growth);
        }
        Ok(())
    }

    /// Measures the errors of the variables of index 1 at the start of the `step` from the residuals of the
    /// constraints, that is, of the equations that contain neither ẏ nor variables of index 2 and 3.
    /// [`constraint_errors`](Self::constraint_errors) then returns these errors. The matrices must be set up for the
    /// size of the step.
    pub(crate) fn measure_constraints<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        y_dot: &[f64],
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let residual = &mut self.residual;
        evaluate(problem, step.t, step.y, y_dot, residual, counters)?;
        self.y.copy_from_slice(step.y);
        for i in self.list.iter().map(|multiplier| multiplier.variable) {
            self.y[i] += SMALL * displacement(self.y[i], i);
        }
        let rates = self.y_dot.iter_mut().zip(y_dot).enumerate();
        rates.for_each(|(i, (moved, v))| *moved = v + SMALL * displacement(*v, i));
        let moved = &mut self.plain;
        evaluate(problem, step.t, &self.y, &self.y_dot, moved, counters)?;
        for (residual, moved) in residual.iter_mut().zip(moved) {
            if *residual != *moved {
                *residual = 0.0;
            }
        }
        if residual.iter().all(|residual| *residual == 0.0) {
            return Ok(());
        }
        counters.work.real_solves += 1;
        matrices.solve_real(problem, residual).map_err(Operation::LinearSolve.failed())
    }

    /// Returns the indices of the differential variables of index 1 and their [measured](Self::measure_constraints)
    /// errors.
    pub(crate) fn constraint_errors(&self) -> impl Iterator<Item = (usize, f64)> {
        self.free.iter().map(|&i| (i, self.residual[i]))
    }

    /// Returns the differential variables of index 0 and 1.
    pub(crate) fn positions(&self) -> &[usize] {
        &self.free
    }

    /// Returns the differential variables of index 2.
    pub(crate) fn velocities(&self) -> impl Iterator<Item = usize> {
        let velocities = self.list.iter().filter(|multiplier| !multiplier.removable);
        velocities.map(|multiplier| multiplier.variable)
    }

    /// Solves for −e(x), with ẏ + x in `y_dot`.
    fn solve<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let (y, y_dot, residual) = (&self.y, &self.y_dot, &mut self.residual);
        evaluate(problem, step.t, y, y_dot, residual, counters)?;
        for (residual, plain) in residual.iter_mut().zip(&self.plain) {
            *residual -= plain;
        }
        counters.work.real_solves += 1;
        matrices.solve_real(problem, residual).map_err(Operation::LinearSolve.failed())
    }

    /// Returns the variables of index 2 and their remaining errors at the end of the step that follows `before`.
    pub(crate) fn remaining_errors<'a>(
        &'a self,
        step: &'a Step<'_>,
        before: &'a Collocation,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let growth = step.h / before.h;
        let of_index_2 = self.list.iter().filter(|multiplier| multiplier.index == 2);
        of_index_2.map(move |multiplier| {
            let [of_missed, _] = profile(step.method, multiplier.index, 1.0);
            let (margin, error) = multiplier.remaining_error(step.method.stages(), growth);
            (multiplier.variable, margin * (of_missed * error).abs())
        })
    }

    /// Returns the largest remaining error at the end of the step, in units of the tolerances. Errors up to `rounding`
    /// are not counted. For velocities, the remaining error is the measured error. For multipliers, it is the change of
    /// the measured error since the step `before`. If the errors consist only of rounding errors, the next step may
    /// grow by the factor `growth_in_noise`.
    pub(crate) fn largest_left(
        &self,
        step: &Step<'_>,
        before: Option<&Collocation>,
        tolerance: impl Fn(usize) -> f64,
        rounding: impl Fn(usize) -> f64,
        growth_in_noise: f64,
    ) -> f64 {
        let stages = step.method.stages();
        let left = self.list.iter().map(|multiplier| {
            let (i, index) = (multiplier.variable, multiplier.index);
            let growth = before.map_or(0.0, |before| step.h / before.h);
            let (margin, error) = multiplier.remaining_error(stages, growth);
            let beyond = error.abs() - rounding(i);
            if multiplier.known.noisy || beyond < 0.0 {
                let order = multiplier.power(stages) + i32::from(multiplier.removable);
                return growth_in_noise.powi(-order);
            }
            let [of_missed, _] = profile(step.method, index, 1.0);
            margin * of_missed.abs() * beyond / tolerance(i)
        });
        left.fold(0.0, f64::max)
    }

    /// Removes the errors from the `increments` of the accepted step.
    pub(crate) fn remove(&mut self, step: &Step<'_>, increments: &mut [f64]) {
        let (n, last_stage) = (step.y.len(), step.method.stages() - 1);
        self.removed.clear();
        for multiplier in &mut self.list {
            let i = multiplier.variable;
            multiplier.known.last = multiplier.missed;
            if !multiplier.removable {
                continue;
            }
            multiplier.known.raw = step.y[i] + increments[last_stage * n + i];
            for (j, &theta) in step.method.nodes().iter().enumerate() {
                let error = multiplier.removed_at(step.method, theta);
                increments[j * n + i] += error;
                self.removed.push(error);
            }
        }
    }

    /// Removes the errors from a copy of the `increments` of a step before its acceptance.
    pub(crate) fn remove_from_copy(&self, step: &Step<'_>, increments: &mut [f64]) {
        let n = step.y.len();
        for multiplier in self.list.iter().filter(|multiplier| multiplier.removable) {
            for (j, &theta) in step.method.nodes().iter().enumerate() {
                increments[j * n + multiplier.variable] +=
                    multiplier.removed_at(step.method, theta);
            }
        }
    }

    /// Restores the removed errors in the `increments` of the last step with `n` unknowns, so that the increments solve
    /// the stage equations again.
    pub(crate) fn undo_removal(&self, n: usize, increments: &mut [f64]) {
        let removable = self.list.iter().filter(|multiplier| multiplier.removable);
        let stages = increments.len() / n;
        for (multiplier, removed) in removable.zip(self.removed.chunks(stages)) {
            for (j, removed) in removed.iter().enumerate() {
                increments[j * n + multiplier.variable] -= removed;
            }
        }
    }
}

impl Multiplier {
    /// Returns whether the variable is algebraic and of index 2.
    fn is_tested(&self) -> bool {
        self.index == 2 && self.removable
    }

    /// Returns the correction that removes the error at t_n + θ h.
    fn removed_at(&self, method: &Method, theta: f64) -> f64 {
        let [of_missed, of_jump] = profile(method, self.index, theta);
        let missed = if self.known.noisy { 0.0 } else { self.missed };
        of_missed * missed + of_jump * self.jump
    }

    /// Returns the margin and the remaining part of e(ε) for a step `growth` times as long as the last step.
    fn remaining_error(&self, stages: usize, growth: f64) -> (f64, f64) {
        match self.removable {
            true => {
                let last = self.known.last * growth.powi(self.power(stages));
                (MARGIN, self.missed - last)
            }
            false => (1.0, self.missed),
        }
    }

    /// Returns the power of h to which e(ε) is proportional.
    fn power(&self, stages: usize) -> i32 {
        stages as i32 + 2 - i32::from(self.index)
    }

    /// Returns whether e(ε) changes with h as rounding errors do, in proportion to h^(1 − index). In this case, the
    /// error is too small to be measured and does not require a smaller step.
    fn changes_like_rounding(&self, stages: usize, growth: f64) -> bool {
        let between = 0.5 * f64::from(self.power(stages) + 1 - i32::from(self.index));
        let excess = (self.missed / self.known.last).abs().ln() - between * growth.ln();
        let telling = growth.ln().abs() > TELLING.ln();
        telling && excess * growth.ln() < 0.0
    }
}

/// Returns a displacement of variable i from `x`. The displacements of the variables differ, so that their effects do
/// not cancel in an equation.
fn displacement(x: f64, i: usize) -> f64 {
    (1.0 + x.abs()) * (0.5 + (0.618 * i as f64).fract())
}

/// Returns the corrections of a multiplier at θ, per unit of e(ε) and per unit of e(−(a + ε)).
fn profile(method: &Method, index: u8, theta: f64) -> [f64; 2] {
    let basis = |derivative| method.start_basis(derivative, theta);
    match index {
        2 => [basis(0) + theta * basis(1), 0.0],
        _ => {
            let gamma = method.real_mode().lambda;
            [(2.0 * basis(1) + theta * basis(2)) / gamma, basis(1) / gamma]
        }
    }
}

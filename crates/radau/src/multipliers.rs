//! What collocation leaves in multipliers, and its removal.

use myovib_dae::{LinearSolver, Problem, VariableKind};
use serde::{Deserialize, Serialize};

use crate::dense::Collocation;
use crate::failure::{Failure, Operation};
use crate::method::Method;
use crate::newton::{Step, evaluate};
use crate::work::Counters;

/// Removes the leading error of algebraic variables of index 2 and 3, and watches that of velocities
/// which a hidden constraint holds.
///
/// Take q̇ = v, v̇ = λ under 0 = q − g(t): Radau IIA has q exactly at 0, c_1, …, c_s. What it gives
/// for v are derivatives of the polynomial u through them, which err at the nodes by −ω'(θ) ε, where
/// q − u = h ε ω to leading order. The v it starts from errs by some a. The next derivative, λ, errs by
///
/// ```text
/// (ℓ_0'(θ) (a + ε) − ω''(θ) ε)/h,   ω = θ ℓ_0,   ℓ_0 = Π (1 − θ/c_i).
/// ```
///
/// A general multiplier of index 3 errs likewise, to leading order, and one of index 2 by −ω'(θ) ε.
/// (So do velocities of index 2, as far as the constraint holds them.)
/// That is the order s + 2 less the index at best, and far from it after a change of h. Both parts can be
/// seen in the variables of index 1: u'(t_n) − ẏ_n is −(a + ε), and ε is how far the polynomial misses
/// the beginning of the last step, over h ω there. What they are in multipliers, Newton's matrix
/// tells:
///
/// ```text
/// e(x) = −(J_y + γ/h J_ẏ)⁻¹ (F(t_n, y_n, ẏ_n + x) − F(t_n, y_n, ẏ_n))
/// ```
///
/// is x in multipliers of index 2, and γ x/h in those of index 3. The steps themselves do not change:
/// no equation of theirs contains the multipliers they start from.
#[derive(Debug)]
pub(crate) struct Multipliers {
    list: Vec<Multiplier>,
    indices: Vec<u8>,
    /// What was added to the multipliers of the last step: for each stage, one after the other.
    removed: Vec<f64>,
    /// The differential variables of index 1.
    free: Vec<usize>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    plain: Vec<f64>,
    defect: Vec<f64>,
}

/// One multiplier, or a velocity of index 2.
#[derive(Debug, Clone)]
struct Multiplier {
    variable: usize,
    index: u8,
    /// Whether its error can be removed: the next step begins with the velocities, not with the
    /// multipliers.
    removable: bool,
    known: Known,
    /// e(ε) of the step just computed.
    missed: f64,
    /// e(−(a + ε)) of it.
    jump: f64,
}

/// What is kept of one from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Known {
    /// What the collocation gave at the end of the last step.
    raw: f64,
    /// e(ε) of the last step.
    last: f64,
    /// Whether it has changed like rounding.
    #[serde(default)]
    noisy: bool,
}

impl Known {
    pub(crate) fn numbers(&self) -> [f64; 2] {
        [self.raw, self.last]
    }
}

/// How much what is left may exceed the change of what was removed: between the coefficients of the
/// next order and those of this one.
const MARGIN: f64 = 2.0;

/// Steps whose sizes differ by less than this factor do not tell rounding from what it hides.
const TELLING: f64 = 1.2;

/// Where the last step is so short that a is less than this fraction of ε, the latter follows from
/// a + ε.
const SHORT: f64 = 0.1;

impl Multipliers {
    pub(crate) fn new(kinds: &[VariableKind], indices: &[u8], y: &[f64]) -> Self {
        let n = y.len();
        let algebraic = |i: usize| kinds[i] == VariableKind::Algebraic;
        let multiplier = |variable| Multiplier {
            variable,
            index: indices[variable],
            removable: algebraic(variable),
            known: Known {
                raw: y[variable],
                last: 0.0,
                noisy: false,
            },
            missed: 0.0,
            jump: 0.0,
        };
        let of_higher_index = (0..n).filter(|&i| indices[i] > 1);
        let list: Vec<_> = of_higher_index.map(multiplier).collect();
        let room = vec![0.0; if list.is_empty() { 0 } else { n }];
        Self {
            free: (0..n)
                .filter(|&i| !algebraic(i) && indices[i] <= 1)
                .collect(),
            list,
            indices: indices.to_vec(),
            removed: Vec::new(),
            y: room.clone(),
            y_dot: room.clone(),
            plain: room.clone(),
            defect: room,
        }
    }

    /// Returns the largest index of all variables.
    pub(crate) fn largest_index(&self) -> u8 {
        self.indices.iter().copied().max().unwrap_or(0)
    }

    /// Returns the index of variable i.
    pub(crate) fn index(&self, i: usize) -> u8 {
        self.indices[i]
    }

    /// Whether there are any: then a hidden constraint magnifies errors by powers of 1/h.
    pub(crate) fn any(&self) -> bool {
        !self.list.is_empty()
    }

    /// The lowest order of the errors that are left; `None` where there are no multipliers.
    pub(crate) fn order(&self, stages: usize) -> Option<i32> {
        let orders = self.list.iter().map(|multiplier| {
            let gained = i32::from(multiplier.removable);
            multiplier.power(stages) + gained
        });
        orders.min()
    }

    /// What is kept from step to step.
    pub(crate) fn known(&self) -> Vec<Known> {
        self.list
            .iter()
            .map(|multiplier| multiplier.known)
            .collect()
    }

    /// Goes on with what is `known`.
    pub(crate) fn restore(&mut self, known: &[Known]) {
        for (multiplier, known) in self.list.iter_mut().zip(known) {
            multiplier.known = *known;
        }
    }

    /// Starts from consistent values `y`.
    pub(crate) fn restart(&mut self, y: &[f64]) {
        for multiplier in &mut self.list {
            multiplier.known.raw = y[multiplier.variable];
        }
    }

    /// Measures both parts of the error of the step with increments `z`, which begins where the
    /// `before` one ends, if there is one, with the derivative `y_dot`.
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
            multiplier.jump = -self.defect[multiplier.variable];
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
                multiplier.missed = -self.defect[multiplier.variable];
            }
        }
        let growth = step.h / before.h;
        for multiplier in &mut self.list {
            multiplier.known.noisy = multiplier.changes_like_rounding(method.stages(), growth);
        }
        Ok(())
    }

    /// Measures what Newton's method left of the equations at the beginning of the step:
    /// [`left_in`](Self::left_in) is the error of `y` and `y_dot` for which a step of this size takes it.
    pub(crate) fn measure_left<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        y_dot: &[f64],
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        self.y.copy_from_slice(step.y);
        for multiplier in self.list.iter().filter(|multiplier| multiplier.removable) {
            self.y[multiplier.variable] = multiplier.known.raw;
        }
        self.y_dot.copy_from_slice(y_dot);
        self.plain.fill(0.0);
        self.solve(problem, matrices, step, counters)
    }

    /// The errors of the variables of index 1 that were [measured](Self::measure_left), with their
    /// places.
    pub(crate) fn left_in(&self) -> impl Iterator<Item = (usize, f64)> {
        self.free.iter().map(|&i| (i, self.defect[i]))
    }

    /// Solves for −e(x), with ẏ + x in `y_dot`.
    fn solve<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let (y, y_dot, defect) = (&self.y, &self.y_dot, &mut self.defect);
        evaluate(problem, step.t, y, y_dot, defect, counters)?;
        for (defect, plain) in defect.iter_mut().zip(&self.plain) {
            *defect -= plain;
        }
        counters.work.real_solves += 1;
        matrices
            .solve_real(problem, defect)
            .map_err(Operation::LinearSolve.failed())
    }

    /// Returns the variables of index 2 with their remaining errors at the end of the step that
    /// follows `before`.
    pub(crate) fn left<'a>(
        &'a self,
        step: &'a Step<'_>,
        before: &'a Collocation,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let growth = step.h / before.h;
        let of_index_2 = self.list.iter().filter(|multiplier| multiplier.index == 2);
        of_index_2.map(move |multiplier| {
            let [of_missed, _] = profile(step.method, multiplier.index, 1.0);
            let (margin, error) = multiplier.left(step.method.stages(), growth);
            (multiplier.variable, margin * (of_missed * error).abs())
        })
    }

    /// The largest error that is left at the end of the step, in units of tolerances, as far as it is
    /// beyond `rounding` in e: of velocities what has been measured, of multipliers the change of that
    /// since the step `before`. Where rounding is all that is seen, the next step may grow by the factor
    /// `growth_in_noise`.
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
            let (margin, error) = multiplier.left(stages, growth);
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

    /// Removes the errors from the `increments` of the step, which has been accepted.
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

    /// Removes the errors from a copy of the `increments` of a step that is only tried.
    pub(crate) fn remove_from_copy(&self, step: &Step<'_>, increments: &mut [f64]) {
        let n = step.y.len();
        for multiplier in self.list.iter().filter(|multiplier| multiplier.removable) {
            for (j, &theta) in step.method.nodes().iter().enumerate() {
                increments[j * n + multiplier.variable] +=
                    multiplier.removed_at(step.method, theta);
            }
        }
    }

    /// Makes the increments of the last step, of `n` unknowns, those that its equations were solved
    /// for.
    pub(crate) fn put_back(&self, n: usize, increments: &mut [f64]) {
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
    /// What is removed at t_n + θ h.
    fn removed_at(&self, method: &Method, theta: f64) -> f64 {
        let [of_missed, of_jump] = profile(method, self.index, theta);
        let missed = if self.known.noisy { 0.0 } else { self.missed };
        of_missed * missed + of_jump * self.jump
    }

    /// Returns the margin and the remaining part of e(ε) in a step `growth` times the size of the last.
    fn left(&self, stages: usize, growth: f64) -> (f64, f64) {
        match self.removable {
            true => {
                let last = self.known.last * growth.powi(self.power(stages));
                (MARGIN, self.missed - last)
            }
            false => (1.0, self.missed),
        }
    }

    /// The power of h that e(ε) goes with.
    fn power(&self, stages: usize) -> i32 {
        stages as i32 + 2 - i32::from(self.index)
    }

    /// Whether e(ε) changes with h rather like rounding, which goes with h^(1 − index): then it is
    /// too small to be seen, and no reason for a smaller step.
    fn changes_like_rounding(&self, stages: usize, growth: f64) -> bool {
        let between = 0.5 * f64::from(self.power(stages) + 1 - i32::from(self.index));
        let excess = (self.missed / self.known.last).abs().ln() - between * growth.ln();
        let telling = growth.ln().abs() > TELLING.ln();
        telling && excess * growth.ln() < 0.0
    }
}

/// What to add to a multiplier at θ for e(ε) and e(−(a + ε)).
fn profile(method: &Method, index: u8, theta: f64) -> [f64; 2] {
    let basis = |derivative| method.start_basis(derivative, theta);
    match index {
        2 => [basis(0) + theta * basis(1), 0.0],
        _ => {
            let gamma = method.real_mode().lambda;
            [
                (2.0 * basis(1) + theta * basis(2)) / gamma,
                basis(1) / gamma,
            ]
        }
    }
}

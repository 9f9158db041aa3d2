//! Internal variables within a step, as linear functions of their initial values and of the driving quantities.

use std::ops::{Add, Mul, Sub};

use crate::method::Method;

use super::RelaxationTerm;

const MAX_STAGES: usize = 7;

/// Index of the driving quantity at the start of the step; the indices of the stages follow.
pub(super) const BEGIN: usize = 0;
/// Index of the change of the driving quantity when y changes by its estimated error.
pub(super) const CHANGE: usize = MAX_STAGES + 1;
/// Indices for a repeated estimate at y minus its first estimated error: the driving quantity at this point, and its
/// change when y changes by the second estimated error.
pub(super) const SHIFTED: usize = CHANGE + 1;
pub(super) const SHIFTED_CHANGE: usize = CHANGE + 2;
pub(super) const N_DRIVING: usize = CHANGE + 3;

/// Linear function `of_state` q + Σ_m `of_driving`_m s_m of the internal variable q of one term and of the driving
/// quantities s_m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Form {
    pub(super) of_state: f64,
    pub(super) of_driving: [f64; N_DRIVING],
}

impl Form {
    /// Returns the function q, the value at the start of the step.
    pub(super) fn state() -> Self {
        Self { of_state: 1.0, ..Self::default() }
    }

    pub(super) fn driving(m: usize) -> Self {
        let mut form = Self::default();
        form.of_driving[m] = 1.0;
        form
    }
}

impl Add for Form {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self.of_state += other.of_state;
        for (own, other) in self.of_driving.iter_mut().zip(other.of_driving) {
            *own += other;
        }
        self
    }
}

impl Sub for Form {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul<f64> for Form {
    type Output = Self;

    fn mul(mut self, factor: f64) -> Self {
        self.of_state *= factor;
        self.of_driving.iter_mut().for_each(|own| *own *= factor);
        self
    }
}

/// A term in a step of size h.
#[derive(Debug, Clone, Copy)]
pub(super) struct TermStep<'m> {
    pub(super) term: RelaxationTerm,
    pub(super) method: &'m Method,
    pub(super) h: f64,
}

impl TermStep<'_> {
    /// Returns q at stage i. The stage equations τ/h Σ_j (A⁻¹)_ij (q_j − q) + q_i = g s_i have the solution q_i = q +
    /// Σ_j W_ij (g s_j − q) with W = (1 + τ/h A⁻¹)⁻¹, which is computed from the modes of A⁻¹.
    pub(super) fn stage(self, i: usize) -> Form {
        let mut form = Form::state();
        for j in 0..self.method.stages() {
            let driven = Form::driving(1 + j) * self.term.weight - Form::state();
            form = form + driven * self.resolvent(i, j);
        }
        form
    }

    fn resolvent(self, i: usize, j: usize) -> f64 {
        let ratio = self.term.time / self.h;
        let real = self.method.real_mode();
        let mut entry = real.right[i] * real.left[j] / (1.0 + ratio * real.lambda);
        for mode in self.method.complex_modes() {
            let of_mode = mode.right[i] * mode.left[j] / (1.0 + ratio * mode.lambda);
            entry += 2.0 * of_mode.re;
        }
        entry
    }

    /// Returns g s − q at stage i.
    pub(super) fn response(self, i: usize) -> Form {
        Form::driving(1 + i) * self.term.weight - self.stage(i)
    }

    /// Returns g s − q at the start, for given forms of the driving quantity s and of the state q.
    pub(super) fn response_of(self, driving: Form, state: Form) -> Form {
        driving * self.term.weight - state
    }

    /// Returns the slope of the collocation polynomial at the start.
    fn start_slope(self) -> Form {
        let slope = |j| (self.stage(j) - Form::state()) * self.method.basis_derivative(j, 0.0);
        (0..self.method.stages()).fold(Form::default(), |sum, j| sum + slope(j) * (1.0 / self.h))
    }

    /// Returns the difference between the slope of the collocation polynomial and q̇ at the start, for given forms of
    /// the driving quantity and of the state.
    fn slope_residual(self, driving: Form, state: Form) -> Form {
        self.start_slope() - self.response_of(driving, state) * (1.0 / self.term.time)
    }

    /// Returns 1/(1 + γτ/h), the ratio of the change of an internal variable to the change of its driving quantity
    /// times the weight g in the real system of Newton's method.
    fn follows(self) -> f64 {
        1.0 / (1.0 + self.term.time * self.method.real_mode().lambda / self.h)
    }

    /// Returns the response in the equations of the error estimate after the internal variables have been eliminated.
    pub(super) fn condensed(self, driving: Form, state: Form) -> Form {
        let lag = self.term.time * self.follows();
        self.response_of(driving, state) + self.slope_residual(driving, state) * lag
    }

    /// Returns the estimated error of the internal variable. `change` is the change of the driving quantity that
    /// corresponds to the estimated error of y.
    pub(super) fn error(self, driving: Form, state: Form, change: Form) -> Form {
        let driven =
            change * self.term.weight - self.slope_residual(driving, state) * self.term.time;
        driven * self.follows()
    }

    /// Returns the form of the dense output, given the coefficients of the initial slope and of the stages.
    pub(super) fn between(
        self,
        derivative: usize,
        (of_slope, of_stages): (f64, impl Iterator<Item = f64>),
    ) -> Form {
        let begin = Form::state() * if derivative == 0 { 1.0 } else { 0.0 };
        let response = self.response_of(Form::driving(BEGIN), Form::state());
        let slope = response * (of_slope / self.term.time);
        of_stages
            .enumerate()
            .fold(begin + slope, |sum, (j, b)| sum + (self.stage(j) - Form::state()) * b)
    }
}

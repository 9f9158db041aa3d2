//! What the states of a fading memory are in a step: linear in what they begin with and in the drives.

use std::ops::{Add, Mul, Sub};

use crate::method::Method;

use super::MemoryTerm;

/// The most stages that a method has.
const MOST_STAGES: usize = 7;

/// The drive at the beginning of the step, then those at its stages.
pub(super) const BEGIN: usize = 0;
/// What the estimated error changes the drive by.
pub(super) const CHANGE: usize = MOST_STAGES + 1;
/// The drive at the beginning less that error, and what the error estimated there changes it by.
pub(super) const SHIFTED: usize = CHANGE + 1;
pub(super) const SHIFTED_CHANGE: usize = CHANGE + 2;
/// How many drives a form may have part in.
pub(super) const DRIVES: usize = CHANGE + 3;

/// `of_state` q + Σ_m `of_drives`_m s_m of the state q of one term.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Form {
    pub(super) of_state: f64,
    pub(super) of_drives: [f64; DRIVES],
}

impl Form {
    /// The state at the beginning of the step.
    pub(super) fn state() -> Self {
        Self {
            of_state: 1.0,
            ..Self::default()
        }
    }

    /// A drive.
    pub(super) fn drive(m: usize) -> Self {
        let mut form = Self::default();
        form.of_drives[m] = 1.0;
        form
    }
}

impl Add for Form {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self.of_state += other.of_state;
        for (own, other) in self.of_drives.iter_mut().zip(other.of_drives) {
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
        self.of_drives.iter_mut().for_each(|own| *own *= factor);
        self
    }
}

/// One term in a step of size h of a method.
#[derive(Debug, Clone, Copy)]
pub(super) struct TermStep<'m> {
    pub(super) term: MemoryTerm,
    pub(super) method: &'m Method,
    pub(super) h: f64,
}

impl TermStep<'_> {
    /// q at stage i: τ/h Σ_j (A⁻¹)_ij (q_j − q) + q_i = g s_i at all stages is
    /// q_i = q + Σ_j W_ij (g s_j − q) with W = (1 + τ/h A⁻¹)⁻¹, by the modes of A⁻¹.
    pub(super) fn stage(self, i: usize) -> Form {
        let mut form = Form::state();
        for j in 0..self.method.stages() {
            let driven = Form::drive(1 + j) * self.term.weight - Form::state();
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

    /// g s − q at stage i.
    pub(super) fn response(self, i: usize) -> Form {
        Form::drive(1 + i) * self.term.weight - self.stage(i)
    }

    /// g s − q at the beginning, with these forms of both.
    pub(super) fn response_of(self, drive: Form, state: Form) -> Form {
        drive * self.term.weight - state
    }

    /// The collocation polynomial's slope at the beginning.
    fn start_slope(self) -> Form {
        let slope = |j| (self.stage(j) - Form::state()) * self.method.basis_derivative(j, 0.0);
        (0..self.method.stages()).fold(Form::default(), |sum, j| sum + slope(j) * (1.0 / self.h))
    }

    /// How far that is from q̇ there, with these forms of drive and state.
    fn defect(self, drive: Form, state: Form) -> Form {
        self.start_slope() - self.response_of(drive, state) * (1.0 / self.term.time)
    }

    /// 1/(1 + γτ/h): how much of its drive a state follows in Newton's real system.
    fn follows(self) -> f64 {
        1.0 / (1.0 + self.term.time * self.method.real_mode().lambda / self.h)
    }

    /// What the response is to be in the equations of the estimate, once the states are eliminated.
    pub(super) fn condensed(self, drive: Form, state: Form) -> Form {
        let lag = self.term.time * self.follows();
        self.response_of(drive, state) + self.defect(drive, state) * lag
    }

    /// The estimated error, where the one of y changes the drive by `change`.
    pub(super) fn error(self, drive: Form, state: Form, change: Form) -> Form {
        let driven = change * self.term.weight - self.defect(drive, state) * self.term.time;
        driven * self.follows()
    }

    /// Dense output, for the `coefficients` of the slope at the beginning and of the stages.
    pub(super) fn between(
        self,
        derivative: usize,
        (of_slope, of_stages): (f64, impl Iterator<Item = f64>),
    ) -> Form {
        let begin = Form::state() * if derivative == 0 { 1.0 } else { 0.0 };
        let response = self.response_of(Form::drive(BEGIN), Form::state());
        let slope = response * (of_slope / self.term.time);
        of_stages.enumerate().fold(begin + slope, |sum, (j, b)| {
            sum + (self.stage(j) - Form::state()) * b
        })
    }
}

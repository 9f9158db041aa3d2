//! Second-order Taylor arithmetic in time: a value with its first two derivatives.

use std::ops::{Add, Mul};

/// The value f(t) and the derivatives f'(t) and f''(t).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jet {
    /// f(t).
    pub value: f64,
    /// f'(t).
    pub d1: f64,
    /// f''(t).
    pub d2: f64,
}

impl Jet {
    /// Creates the jet of a constant function.
    pub fn constant(value: f64) -> Self {
        Self { value, d1: 0.0, d2: 0.0 }
    }

    /// Creates the jet of the function f(t) = t.
    pub fn variable(t: f64) -> Self {
        Self { value: t, d1: 1.0, d2: 0.0 }
    }

    /// Returns g(f(t)) from g, g', g'' at f(t) (chain rule).
    pub(crate) fn compose(self, g: f64, dg: f64, ddg: f64) -> Self {
        Self { value: g, d1: dg * self.d1, d2: ddg * self.d1 * self.d1 + dg * self.d2 }
    }

    /// Returns sin f.
    pub fn sin(self) -> Self {
        let (s, c) = self.value.sin_cos();
        self.compose(s, c, -s)
    }

    /// Returns the logistic function 1/(1 + exp(-f)).
    pub fn sigmoid(self) -> Self {
        let s = 1.0 / (1.0 + (-self.value).exp());
        let ds = s * (1.0 - s);
        self.compose(s, ds, ds * (1.0 - 2.0 * s))
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, d1: self.d1 + other.d1, d2: self.d2 + other.d2 }
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(self, constant: f64) -> Self {
        self + Self::constant(constant)
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            d1: self.d1 * other.value + self.value * other.d1,
            d2: self.d2 * other.value + 2.0 * self.d1 * other.d1 + self.value * other.d2,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self * Self::constant(factor)
    }
}

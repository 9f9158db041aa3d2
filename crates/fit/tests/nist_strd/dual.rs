//! Automatic forward differentiation, which allows each model to be written only once.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Largest number of parameters of any NIST model.
pub(crate) const MOST: usize = 9;

/// Number with its derivatives with respect to the parameters.
#[derive(Clone, Copy)]
pub(crate) struct Dual {
    pub(crate) value: f64,
    pub(crate) slopes: [f64; MOST],
}

impl Dual {
    pub(crate) fn constant(value: f64) -> Self {
        Self { value, slopes: [0.0; MOST] }
    }

    pub(crate) fn parameter(j: usize, value: f64) -> Self {
        let mut slopes = [0.0; MOST];
        slopes[j] = 1.0;
        Self { value, slopes }
    }

    fn chain(self, value: f64, slope: f64) -> Self {
        Self { value, slopes: self.slopes.map(|s| slope * s) }
    }

    pub(crate) fn exp(self) -> Self {
        let e = self.value.exp();
        self.chain(e, e)
    }

    pub(crate) fn ln(self) -> Self {
        self.chain(self.value.ln(), self.value.recip())
    }

    pub(crate) fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }

    pub(crate) fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }

    pub(crate) fn atan(self) -> Self {
        self.chain(self.value.atan(), (1.0 + self.value * self.value).recip())
    }

    /// Returns self^power for a positive base.
    pub(crate) fn pow(self, power: impl Into<Self>) -> Self {
        (power.into() * self.ln()).exp()
    }

    pub(crate) fn square(self) -> Self {
        self * self
    }
}

impl From<f64> for Dual {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<T: Into<Self>> Add<T> for Dual {
    type Output = Self;
    fn add(self, other: T) -> Self {
        let other = other.into();
        let slopes = std::array::from_fn(|j| self.slopes[j] + other.slopes[j]);
        Self { value: self.value + other.value, slopes }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // A difference is computed as a sum.
impl<T: Into<Self>> Sub<T> for Dual {
    type Output = Self;
    fn sub(self, other: T) -> Self {
        self + -other.into()
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // The derivative of a product is a sum.
impl<T: Into<Self>> Mul<T> for Dual {
    type Output = Self;
    fn mul(self, other: T) -> Self {
        let other = other.into();
        let slopes =
            std::array::from_fn(|j| self.slopes[j] * other.value + self.value * other.slopes[j]);
        Self { value: self.value * other.value, slopes }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // A quotient is computed as a product.
impl<T: Into<Self>> Div<T> for Dual {
    type Output = Self;
    fn div(self, other: T) -> Self {
        let other = other.into();
        self * other.chain(other.value.recip(), -other.value.recip().powi(2))
    }
}

//! Dual numbers for automatic differentiation, so that equations are written only once.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Scalar type of equations: `f64`, or a number with derivatives.
pub trait Differentiable:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Returns the value without derivatives.
    fn value(self) -> f64;

    /// Returns sin x.
    #[must_use]
    fn sin(self) -> Self;

    /// Returns cos x.
    #[must_use]
    fn cos(self) -> Self;

    /// Returns eˣ.
    #[must_use]
    fn exp(self) -> Self;

    /// Returns √x.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Returns c x, where c is constant.
    #[must_use]
    fn times(self, c: f64) -> Self {
        self * Self::from(c)
    }
}

impl Differentiable for f64 {
    fn value(self) -> f64 {
        self
    }

    fn sin(self) -> Self {
        f64::sin(self)
    }

    fn cos(self) -> Self {
        f64::cos(self)
    }

    fn exp(self) -> Self {
        f64::exp(self)
    }

    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
}

/// Dual number x + ε x' with ε² = 0. Its parts may themselves be dual numbers, which provides second derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<S> {
    /// The value x.
    pub value: S,
    /// The derivative x'.
    pub slope: S,
}

impl<S: Differentiable> Dual<S> {
    /// Creates the number x with the derivative `slope`.
    pub fn new(value: S, slope: S) -> Self {
        Self { value, slope }
    }

    /// Returns f(x), given the value f(x) and the slope f'(x).
    fn image(self, value: S, slope: S) -> Self {
        Self::new(value, slope * self.slope)
    }
}

impl<S: Differentiable> From<f64> for Dual<S> {
    fn from(value: f64) -> Self {
        Self::new(S::from(value), S::from(0.0))
    }
}

impl<S: Differentiable> Add for Dual<S> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, self.slope + other.slope)
    }
}

impl<S: Differentiable> Sub for Dual<S> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, self.slope - other.slope)
    }
}

impl<S: Differentiable> Mul for Dual<S> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let slope = self.slope * other.value + self.value * other.slope;
        Self::new(self.value * other.value, slope)
    }
}

impl<S: Differentiable> Div for Dual<S> {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        Self::new(quotient, (self.slope - quotient * other.slope) / other.value)
    }
}

impl<S: Differentiable> Neg for Dual<S> {
    type Output = Self;

    fn neg(self) -> Self {
        Self::new(-self.value, -self.slope)
    }
}

impl<S: Differentiable> Differentiable for Dual<S> {
    fn value(self) -> f64 {
        self.value.value()
    }

    fn sin(self) -> Self {
        self.image(self.value.sin(), self.value.cos())
    }

    fn cos(self) -> Self {
        self.image(self.value.cos(), -self.value.sin())
    }

    fn exp(self) -> Self {
        let value = self.value.exp();
        self.image(value, value)
    }

    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        self.image(value, S::from(0.5) / value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evaluates f = sin x · eˣ / √(1 + x²) − cos x for any scalar type.
    fn function<S: Differentiable>(x: S) -> S {
        x.sin() * x.exp() / (S::from(1.0) + x * x).sqrt() - x.cos()
    }

    #[test]
    fn slopes_are_derivatives_of_first_and_second_order() {
        let (x, d) = (0.7, 1e-5);
        let one = |x| Dual::new(x, 1.0);
        let slope = function(one(x)).slope;
        let difference = (function(x + d) - function(x - d)) / (2.0 * d);
        // The error of a central difference is about d², plus rounding errors divided by d.
        assert!((slope - difference).abs() < 1e-9, "{slope} {difference}");
        let twice = function(Dual::new(one(x), one(x)));
        let difference = (function(one(x + d)).slope - function(one(x - d)).slope) / (2.0 * d);
        let second = function(Dual::new(Dual::new(x, 1.0), Dual::new(1.0, 0.0))).slope.slope;
        assert!((second - difference).abs() < 1e-9, "{second} {difference}");
        assert_eq!(twice.value.slope, slope);
    }
}

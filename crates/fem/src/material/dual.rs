//! Dual numbers, which provide rates and tangents by automatic differentiation.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::Real;

/// Number with a directional derivative: `f(x + ε ẋ) = f(x) + ε f'(x) ẋ`, ε² = 0.
///
/// # Examples
/// ```
/// use myovib_fem::material::{Dual, Real};
/// let x = Dual { value: 0.5, rate: 2.0 };
/// let y = x.exp() * x;
/// assert!((y.rate - 0.5_f64.exp() * (1.0 + 0.5) * 2.0).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<R> {
    /// Value.
    pub value: R,
    /// Derivative.
    pub rate: R,
}

impl<R: Real> Dual<R> {
    /// Creates a number with zero derivative.
    #[inline(always)]
    pub fn constant(value: R) -> Self {
        let rate = value.like(0.0);
        Self { value, rate }
    }

    /// Returns f(x) from its value and its slope f'(x).
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        let rate = slope * self.rate;
        Self { value, rate }
    }
}

impl<R: Real> Add for Dual<R> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, rate: self.rate + other.rate }
    }
}

impl<R: Real> Sub for Dual<R> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, rate: self.rate - other.rate }
    }
}

impl<R: Real> Mul for Dual<R> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.value.mul_add(other.rate, self.rate * other.value),
        }
    }
}

impl<R: Real> Div for Dual<R> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, rate: (self.rate - value * other.rate) / other.value }
    }
}

impl<R: Real> Mul<f64> for Dual<R> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, rate: self.rate * factor }
    }
}

impl<R: Real> Neg for Dual<R> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate }
    }
}

impl<R: Real> Real for Dual<R> {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self::constant(self.value.like(value))
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        let rate = self.rate.mul_add(a.value, b.rate);
        Self { value: self.value.mul_add(a.value, b.value), rate: self.value.mul_add(a.rate, rate) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, root.like(0.5) / root)
    }

    #[inline(always)]
    fn inverse_cube_root(self) -> Self {
        let y = self.value.inverse_cube_root();
        let square = y * y;
        self.chain(y, square * square * (-1.0 / 3.0))
    }

    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }

    #[inline(always)]
    fn exp_m1(self) -> Self {
        self.chain(self.value.exp_m1(), self.value.exp())
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        let (one, value) = (self.value.like(1.0), self.value.ln_1p());
        // The rate is NaN below −1, like the value.
        self.chain(value, one / (one + self.value) + value * 0.0)
    }

    #[inline(always)]
    fn choose(self, then: Self, otherwise: Self) -> Self {
        Self {
            value: self.value.choose(then.value, otherwise.value),
            rate: self.value.choose(then.rate, otherwise.rate),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Dual;
    use crate::material::Real;

    /// Evaluates every operation at a point where all operations are regular.
    fn all<R: Real>(x: R, y: R) -> [R; 12] {
        [
            x + y,
            x - y,
            x * y,
            x / y,
            x * 3.0,
            -x,
            x.mul_add(y, x * x),
            x.sqrt() * y,
            x.inverse_cube_root() + y,
            x.exp() * y.exp_m1(),
            (x * y).ln_1p(),
            (x - y).choose(x * x, y) + (y - x).choose(x, y * y),
        ]
    }

    /// Regression: laws with a logarithm had finite stresses beyond the limit of their domain.
    #[test]
    fn the_logarithm_has_no_rate_outside_its_domain() {
        assert!(Dual { value: -1.5, rate: 1.0 }.ln_1p().rate.is_nan());
    }

    #[test]
    fn rates_match_central_differences() {
        let (x, y, x_rate, y_rate) = (0.8, 1.3, 0.7, -0.4);
        let step = 6e-6;
        let at = |s: f64| all(x + s * x_rate, y + s * y_rate);
        let (plus, minus) = (at(step), at(-step));
        let duals = all(Dual { value: x, rate: x_rate }, Dual { value: y, rate: y_rate });
        for (k, dual) in duals.iter().enumerate() {
            let difference = (plus[k] - minus[k]) / (2.0 * step);
            // For functions of order one, the rounding and truncation errors are of order ε^(2/3).
            assert!((dual.rate - difference).abs() < 1e-9, "operation {k}");
            assert_eq!(dual.value, all(x, y)[k], "operation {k}");
        }
    }
}

//! The numbers a Newton matrix is made of: real for BDF, complex for Radau IIA.

use std::ops::{AddAssign, Mul, SubAssign};

use num_complex::{Complex64, ComplexFloat};
use sundials_wrap::klu::Scalar;

/// `f64` or `Complex64`.
pub trait Number:
    Scalar
    + ComplexFloat<Real = f64>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
    + std::fmt::Debug
{
    /// `self` + a b, with fused multiply-adds: one instruction where the processor has it.
    fn plus_product(self, a: Self, b: Self) -> Self;
}

/// p_0 + p_1 c + p_2 c²: the coefficient of a matrix in a reduced Newton matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Quadratic(pub(super) [f64; 3]);

impl Quadratic {
    /// The value at `c`.
    pub(super) fn at<T: Number>(&self, c: T) -> T {
        let [p0, p1, p2] = self.0;
        T::one() * p0 + c * p1 + c * c * p2
    }
}

impl Number for f64 {
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }
}

impl Number for Complex64 {
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        Self {
            re: (-a.im).mul_add(b.im, a.re.mul_add(b.re, self.re)),
            im: a.im.mul_add(b.re, a.re.mul_add(b.im, self.im)),
        }
    }
}

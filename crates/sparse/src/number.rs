//! The numbers a Newton matrix is made of: real for BDF, complex for Radau IIA.

use std::ops::{AddAssign, Mul, SubAssign};

use crate::klu::Scalar;
use num_complex::{Complex64, ComplexFloat};

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

//! The numbers a law is evaluated on: one `f64`, or one for each element of a batch.

use std::ops::{Add, Mul, Neg, Sub};

/// `f64` or [`Lanes`](crate::lanes::Lanes).
///
/// A law is written once for both; the functions are inlined, so that on lanes every operation is
/// one vector instruction.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
{
    /// A constant of the same kind as `self`.
    fn like(self, value: f64) -> Self;

    /// `self` · a + b, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;

    /// Applies `f` to each `f64`.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        f64::mul_add(self, a, b)
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        f(self)
    }
}

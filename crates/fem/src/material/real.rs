//! Number types with which laws are evaluated: `f64`, vector registers, or dual numbers of these types.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number type: `f64`, a vector register with one number per element, or a [`Dual`](super::Dual) of these.
///
/// A law is written once for all number types. Its functions must be `#[inline(always)]`, so that every operation
/// is one vector instruction. They must not branch on values; use [`choose`](Real::choose) instead of `if`.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
{
    /// Returns a constant of the same type as `self`.
    fn like(self, value: f64) -> Self;

    /// Returns `self` · a + b with a single rounding.
    fn mul_add(self, a: Self, b: Self) -> Self;

    /// Returns √x.
    fn sqrt(self) -> Self;

    /// Returns x^(−1/3) for normal x > 0.
    fn inverse_cube_root(self) -> Self;

    /// Returns eˣ with an error of at most two units in the last place. The result is ∞ above 709.4.
    fn exp(self) -> Self;

    /// Returns eˣ − 1 without cancellation near zero. The function is slower than [`exp`](Real::exp) and is
    /// intended for energies.
    fn exp_m1(self) -> Self;

    /// Returns ln(1 + x) without cancellation near zero. The function is slow and is intended for energies.
    fn ln_1p(self) -> Self;

    /// Returns `then` if `self` ≥ 0, and `otherwise` if `self` is negative or NaN.
    fn choose(self, then: Self, otherwise: Self) -> Self;
}

/// Number type without derivatives, so that functions may operate on the bits of its values.
pub(crate) trait Plain: Real {
    /// Applies `f` to each `f64`.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
}

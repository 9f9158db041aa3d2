//! The numbers a law is evaluated on: one `f64`, one for each element of a batch, or either with a
//! derivative.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `f64`, a register with one number for each of some elements, or a [`Dual`](super::Dual) of these.
///
/// A law is written once for all of them. What it calls is inlined, so that on registers every
/// operation is one vector instruction; therefore a law does not branch on values:
/// [`choose`](Real::choose) takes the place of `if`.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
{
    /// A constant of the same kind as `self`.
    fn like(self, value: f64) -> Self;

    /// `self` · a + b, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;

    /// √x.
    fn sqrt(self) -> Self;

    /// x^(−1/3) for normal x > 0.
    fn inverse_cube_root(self) -> Self;

    /// eˣ to two units in the last place; ∞ above 709.4.
    fn exp(self) -> Self;

    /// eˣ − 1 without cancellation near zero; slower than [`exp`](Real::exp), for energies.
    fn exp_m1(self) -> Self;

    /// ln(1 + x) without cancellation near zero; slow, for energies.
    fn ln_1p(self) -> Self;

    /// `then` where `self` ≥ 0, `otherwise` elsewhere and where `self` is not a number.
    fn choose(self, then: Self, otherwise: Self) -> Self;
}

/// Numbers without derivative: what functions of single bits may be applied to.
pub(crate) trait Plain: Real {
    /// Applies `f` to each `f64`.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
}

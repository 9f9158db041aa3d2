//! The numbers a Newton matrix is made of: real for BDF, complex for Radau IIA.

use std::ops::{AddAssign, Mul, SubAssign};

use num_complex::ComplexFloat;
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
}

impl<T> Number for T where
    T: Scalar
        + ComplexFloat<Real = f64>
        + Mul<f64, Output = T>
        + AddAssign
        + SubAssign
        + std::fmt::Debug
{
}

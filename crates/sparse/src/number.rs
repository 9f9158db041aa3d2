//! The numbers a Newton matrix is made of: real for BDF, complex for Radau IIA.

use std::ops::{AddAssign, Mul, MulAssign, SubAssign};
use std::sync::Arc;

use faer::traits::ComplexField;
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::{Complex64, ComplexFloat};

use crate::engine::Engine;
use crate::{Factorization, Kind, SparseError};

#[cfg(klu)]
use crate::klu::Scalar;

/// A number that all factorisations can deal with.
#[cfg(not(klu))]
pub trait Scalar: 'static {}
#[cfg(not(klu))]
impl Scalar for f64 {}
#[cfg(not(klu))]
impl Scalar for Complex64 {}

/// `f64` or `Complex64`.
pub trait Number:
    Scalar
    + ComplexFloat<Real = f64>
    + ComplexField
    + Send
    + Sync
    + Mul<f64, Output = Self>
    + AddAssign
    + MulAssign
    + SubAssign
    + std::fmt::Debug
{
    /// `self` + a b, with fused multiply-adds: one instruction where the processor has it.
    fn plus_product(self, a: Self, b: Self) -> Self;

    /// Room for matrices of these numbers and their factors in an `engine`.
    fn factors_of(
        engine: &dyn Engine,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Self>>;
}

impl Number for f64 {
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }

    fn factors_of(
        engine: &dyn Engine,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Self>> {
        engine.real(pattern, kind)
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

    fn factors_of(
        engine: &dyn Engine,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Self>> {
        engine.complex(pattern, kind)
    }
}

/// Whether all parts of a number are finite.
pub(crate) fn is_finite<T: Number>(x: T) -> bool {
    ComplexFloat::is_finite(x)
}

/// Checks that all `values` of something are finite.
///
/// # Errors
/// [`SparseError::NotFinite`].
pub(crate) fn expect_finite<T: Number>(values: &[T], of: &'static str) -> Result<(), SparseError> {
    match values.iter().position(|&value| !is_finite(value)) {
        Some(position) => Err(SparseError::NotFinite { of, position }),
        None => Ok(()),
    }
}

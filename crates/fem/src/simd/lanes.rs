//! Vector register with one number per element.
//!
//! Functions of lanes use loops and are always inlined. Closures (for example in `array::map`) would be compiled
//! as separate functions without vector instructions.

use std::ops::{Add, Div, Mul, Neg, Sub};
use std::slice::{from_mut, from_ref};

use pulp::bytemuck::{cast_slice, cast_slice_mut};
use pulp::{Simd, WithSimd};

use crate::material::elementary;
use crate::material::real::{Plain, Real};

/// Runs `op` as a separate function with the instructions of `simd`. If `op` is called from several loops, it is
/// then compiled only once. Long functions are not inlined into even longer functions.
#[inline(never)]
pub(crate) fn outlined<S: Simd, Op: WithSimd>(simd: S, op: Op) -> Op::Output {
    simd.vectorize(op)
}

/// Number of elements per batch, which fill one AVX-512 register of f64 or two AVX2 registers.
pub(crate) const LANES: usize = 8;

/// One number per element of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub(crate) struct Array(pub(crate) [f64; LANES]);

impl Array {
    pub(crate) const ZERO: Self = Self([0.0; LANES]);
}

/// Vector register with one number for each of the elements that fit in it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes<S: Simd> {
    simd: S,
    value: S::f64s,
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        Self::splat(simd, 0.0)
    }

    /// Returns a register with the same number in all lanes.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        let value = simd.splat_f64s(value);
        Self { simd, value }
    }

    /// Returns the instruction set.
    #[inline(always)]
    pub(crate) fn simd(&self) -> S {
        self.simd
    }

    /// Loads the register with the index `part` from an array.
    #[inline(always)]
    pub(crate) fn load(simd: S, array: &Array, part: usize) -> Self {
        let value = S::as_simd_f64s(&array.0).0[part];
        Self { simd, value }
    }

    /// Stores the register with the index `part` in an array.
    #[inline(always)]
    pub(crate) fn store(&self, array: &mut Array, part: usize) {
        let values = self.as_slice();
        array.0[part * values.len()..][..values.len()].copy_from_slice(values);
    }

    #[inline(always)]
    pub(crate) fn as_slice(&self) -> &[f64] {
        cast_slice(from_ref(&self.value))
    }

    #[inline(always)]
    pub(crate) fn as_mut_slice(&mut self) -> &mut [f64] {
        cast_slice_mut(from_mut(&mut self.value))
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let value = self.simd.add_f64s(self.value, other.value);
        Self { value, ..self }
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let value = self.simd.sub_f64s(self.value, other.value);
        Self { value, ..self }
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let value = self.simd.mul_f64s(self.value, other.value);
        Self { value, ..self }
    }
}

impl<S: Simd> Div for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.simd.div_f64s(self.value, other.value);
        Self { value, ..self }
    }
}

impl<S: Simd> Mul<f64> for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * self.like(factor)
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let value = self.simd.neg_f64s(self.value);
        Self { value, ..self }
    }
}

impl<S: Simd> Real for Lanes<S> {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        let value = self.simd.splat_f64s(value);
        Self { value, ..self }
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        let value = self.simd.mul_add_f64s(self.value, a.value, b.value);
        Self { value, ..self }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.simd.sqrt_f64s(self.value);
        Self { value, ..self }
    }

    #[inline(always)]
    fn inverse_cube_root(self) -> Self {
        elementary::inverse_cube_root(self)
    }

    #[inline(always)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }

    #[inline(always)]
    fn exp_m1(self) -> Self {
        self.map(f64::exp_m1)
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        self.map(f64::ln_1p)
    }

    #[inline(always)]
    fn choose(self, then: Self, otherwise: Self) -> Self {
        let zero = self.simd.splat_f64s(0.0);
        let mask = self.simd.greater_than_or_equal_f64s(self.value, zero);
        let value = self.simd.select_f64s(mask, then.value, otherwise.value);
        Self { value, ..self }
    }
}

impl<S: Simd> Plain for Lanes<S> {
    #[inline(always)]
    fn map(mut self, f: impl Fn(f64) -> f64) -> Self {
        for lane in self.as_mut_slice() {
            *lane = f(*lane);
        }
        self
    }
}

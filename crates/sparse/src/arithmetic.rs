//! The numbers a Newton matrix is made of: real for BDF, complex for Radau IIA.

use std::ops::{AddAssign, Mul, MulAssign, SubAssign};

use faer::traits::ComplexField;
use num_complex::{Complex64, ComplexFloat};

#[cfg(klu)]
use crate::klu::Scalar;

/// A number that all factorisations can deal with.
#[cfg(not(klu))]
pub trait Scalar: 'static {}
#[cfg(not(klu))]
impl Scalar for f64 {}
#[cfg(not(klu))]
impl Scalar for Complex64 {}

/// The numbers in one row of some columns, by which an entry of a matrix is multiplied at once: one
/// number, or [several](Arithmetic::Columns).
pub trait Row<T>: Copy + Send + Sync + std::fmt::Debug {
    /// Zeros.
    fn none() -> Self;

    /// The first numbers of `row`, which has as many at least.
    fn load(row: &[T]) -> Self;

    /// Writes them to the front of `row`.
    fn store(self, row: &mut [T]);

    /// `self` + `other`.
    fn plus(self, other: Self) -> Self;

    /// a `self`.
    fn times(self, a: T) -> Self;

    /// `self` − a x, with fused multiply-adds.
    fn less_product(self, a: T, x: Self) -> Self;
}

impl<T: Arithmetic> Row<T> for T {
    #[inline(always)]
    fn none() -> Self {
        Self::zero()
    }

    #[inline(always)]
    fn load(row: &[T]) -> Self {
        row[0]
    }

    #[inline(always)]
    fn store(self, row: &mut [T]) {
        row[0] = self;
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn times(self, a: T) -> Self {
        self * a
    }

    #[inline(always)]
    fn less_product(self, a: T, x: Self) -> Self {
        self.plus_product(a, -x)
    }
}

/// Real numbers side by side.
#[derive(Debug, Clone, Copy)]
pub struct Reals<const C: usize>([f64; C]);

/// Complex numbers side by side: their real parts, then their imaginary parts.
#[derive(Debug, Clone, Copy)]
pub struct Complexes<const C: usize>([[f64; C]; 2]);

impl<const C: usize> Row<f64> for Reals<C> {
    #[inline(always)]
    fn none() -> Self {
        Self([0.0; C])
    }

    #[inline(always)]
    fn load(row: &[f64]) -> Self {
        let mut own = [0.0; C];
        own.copy_from_slice(&row[..C]);
        Self(own)
    }

    #[inline(always)]
    fn store(self, row: &mut [f64]) {
        row[..C].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn plus(mut self, other: Self) -> Self {
        for c in 0..C {
            self.0[c] += other.0[c];
        }
        self
    }

    #[inline(always)]
    fn times(mut self, a: f64) -> Self {
        for c in 0..C {
            self.0[c] *= a;
        }
        self
    }

    #[inline(always)]
    fn less_product(mut self, a: f64, x: Self) -> Self {
        for c in 0..C {
            self.0[c] = a.mul_add(-x.0[c], self.0[c]);
        }
        self
    }
}

impl<const C: usize> Row<Complex64> for Complexes<C> {
    #[inline(always)]
    fn none() -> Self {
        Self([[0.0; C]; 2])
    }

    #[inline(always)]
    fn load(row: &[Complex64]) -> Self {
        let mut own = Self::none();
        let [re, im] = &mut own.0;
        for ((re, im), x) in re.iter_mut().zip(im).zip(&row[..C]) {
            (*re, *im) = (x.re, x.im);
        }
        own
    }

    #[inline(always)]
    fn store(self, row: &mut [Complex64]) {
        let [re, im] = self.0;
        for ((re, im), x) in re.iter().zip(&im).zip(&mut row[..C]) {
            (x.re, x.im) = (*re, *im);
        }
    }

    #[inline(always)]
    fn plus(mut self, other: Self) -> Self {
        let parts = self.0.as_flattened_mut();
        for (own, other) in parts.iter_mut().zip(other.0.as_flattened()) {
            *own += other;
        }
        self
    }

    #[inline(always)]
    fn times(self, a: Complex64) -> Self {
        Self::none().less_product(-a, self)
    }

    #[inline(always)]
    fn less_product(mut self, a: Complex64, x: Self) -> Self {
        // Two columns fill no vector that could hold both parts.
        if C < 4 {
            let ([re, im], [x_re, x_im]) = (&mut self.0, x.0);
            for c in 0..C {
                re[c] = a.im.mul_add(x_im[c], a.re.mul_add(-x_re[c], re[c]));
                im[c] = a.im.mul_add(-x_re[c], a.re.mul_add(-x_im[c], im[c]));
            }
            return self;
        }
        // −i x.
        let mut turned = [x.0[1]; 2];
        for (turned, re) in turned[1].iter_mut().zip(&x.0[0]) {
            *turned = -re;
        }
        let parts = self.0.as_flattened_mut();
        let (x, turned) = (x.0.as_flattened(), turned.as_flattened());
        for k in 0..2 * C {
            parts[k] = a.im.mul_add(turned[k], a.re.mul_add(-x[k], parts[k]));
        }
        self
    }
}

/// What the loops over `f64` and `Complex64` compute with.
pub trait Arithmetic:
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
    /// C of them side by side, in vector registers.
    type Columns<const C: usize>: Row<Self>;

    /// `self` + a b, with fused multiply-adds: one instruction where the processor has it.
    fn plus_product(self, a: Self, b: Self) -> Self;
}

impl Arithmetic for f64 {
    type Columns<const C: usize> = Reals<C>;

    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }
}

impl Arithmetic for Complex64 {
    type Columns<const C: usize> = Complexes<C>;

    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        Self {
            re: (-a.im).mul_add(b.im, a.re.mul_add(b.re, self.re)),
            im: a.im.mul_add(b.re, a.re.mul_add(b.im, self.im)),
        }
    }
}

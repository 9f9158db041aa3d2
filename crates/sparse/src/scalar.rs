//! Scalar type of a matrix: real for BDF; real and complex for Radau IIA.
//!
//! The loops for the two types are instantiated in this crate. Generic code would otherwise be compiled again in each
//! crate that calls it: every crate and every test that solves a linear system would compile all kernels for all
//! instruction sets.

use std::ops::{AddAssign, Mul, MulAssign, SubAssign};
use std::sync::Arc;

use faer::traits::ComplexField;
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::{Complex32, Complex64, ComplexFloat};

use crate::engine::Engine;
#[cfg(not(klu))]
use crate::lu::{Lu, Symbolic};
use crate::product::Product;
use crate::row::{Complexes, Reals, Row};
use crate::supernodal::Supernodal;
use crate::{Factorization, Kind, SparseError};

mod sealed {
    pub trait Number {}

    impl Number for f32 {}
    impl Number for f64 {}
    impl Number for super::Complex32 {}
    impl Number for super::Complex64 {}

    #[cfg(klu)]
    pub trait Scalar: crate::ffi::klu::Entry {}
    #[cfg(not(klu))]
    pub trait Scalar {}

    impl Scalar for f64 {}
    impl Scalar for super::Complex64 {}
}

/// Entry of [`Supernodal`] factors: real or complex, in single or double precision.
///
/// The methods are intended for this crate only; they instantiate its kernels.
pub trait Number:
    sealed::Number
    + ComplexFloat
    + ComplexField
    + Send
    + Sync
    + AddAssign
    + MulAssign
    + SubAssign
    + std::fmt::Debug
    + 'static
{
    /// Row of C right-hand sides in vector registers.
    type Columns<const C: usize>: Row<Self>;

    /// Returns `self` + a b, using a fused multiply-add: one instruction if the processor supports it.
    fn plus_product(self, a: Self, b: Self) -> Self;

    /// Returns `self` + a x for a real number x, using fused multiply-adds.
    fn plus_real_product(self, a: Self, x: <Self as ComplexFloat>::Real) -> Self;

    /// Returns Σ a b, given the sums Σ a Re b and Σ a Im b.
    fn of_sums(with_re: Self, with_im: Self) -> Self;

    /// Implements [`Supernodal::factor`].
    ///
    /// # Errors
    /// Returns [`SparseError::ZeroPivot`] if a pivot is zero or not finite.
    fn factor(factors: &mut Supernodal<Self>, values: &[Self]) -> Result<(), SparseError>;

    /// Solves with [`Supernodal`] factors.
    fn solve_by_blocks(factors: &mut Supernodal<Self>, rhs: &mut [Self], is_transposed: bool);
}

/// Scalar type of a matrix: `f64` or `Complex64`.
///
/// The methods are intended for this crate only; they instantiate its kernels.
pub trait Scalar:
    sealed::Scalar + Number + ComplexFloat<Real = f64> + Mul<f64, Output = Self>
{
    /// The corresponding type in single precision.
    type Single: Number;

    /// Rounds to single precision.
    fn to_single(self) -> Self::Single;

    /// Converts from single precision.
    fn from_single(single: Self::Single) -> Self;

    /// Allocates a matrix of this type and its factors by an `engine`.
    fn factors_of(
        engine: &dyn Engine,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Self>>;

    /// Implements [`Supernodal::solve_columns`].
    fn solve_columns_by_blocks(factors: &mut Supernodal<Self>, rhs: &mut [Self], n: usize);

    /// Implements [`Product::subtract`].
    fn subtract(product: &Product, values: &[Self], x: &[Self], y: &mut [Self]);

    /// Implements [`Product::subtract_transposed`].
    fn subtract_transposed(product: &Product, values: &[Self], x: &[Self], y: &mut [Self]);

    /// Implements [`Product::subtract_columns`].
    fn subtract_columns(product: &Product, values: &[Self], x: &[Self], y: &mut [Self], n: usize);

    /// Implements [`Product::subtract_transposed_columns`].
    fn subtract_transposed_columns(
        product: &Product,
        values: &[Self],
        x: &[Self],
        y: &mut [Self],
        n: usize,
    );

    /// Implements `Product::add_magnitudes`.
    fn add_magnitudes(product: &Product, values: &[Self], x: &[Self], y: &mut [f64]);

    /// Implements [`Lu::new`].
    #[cfg(not(klu))]
    fn lu(symbolic: Symbolic) -> Lu<Self>;

    /// Implements [`Lu::factor`].
    #[cfg(not(klu))]
    fn factor_lu(lu: &mut Lu<Self>, values: &[Self]) -> Option<()>;

    /// Implements [`Lu::solve`].
    #[cfg(not(klu))]
    fn solve_lu(lu: &mut Lu<Self>, x: &mut [Self], is_transposed: bool);
}

macro_rules! numbers {
    ($(
        $T:ident: $Columns:ident<$F:ident>, |$s:ident, $a:ident, $b:ident| $product:expr,
        |$x:ident| $real_product:expr, |$re:ident, $im:ident| $of_sums:expr;
    )*) => {$(
        impl Number for $T {
            type Columns<const C: usize> = $Columns<$F, C>;

            #[inline(always)]
            fn plus_product(self, $a: Self, $b: Self) -> Self {
                let $s = self;
                $product
            }

            #[inline(always)]
            fn plus_real_product(self, $a: Self, $x: $F) -> Self {
                let $s = self;
                $real_product
            }

            #[inline(always)]
            fn of_sums($re: Self, $im: Self) -> Self {
                $of_sums
            }

            fn factor(factors: &mut Supernodal<$T>, values: &[$T]) -> Result<(), SparseError> {
                factors.factor_by_blocks(values)
            }

            fn solve_by_blocks(
                factors: &mut Supernodal<$T>,
                rhs: &mut [$T],
                is_transposed: bool,
            ) {
                factors.run_one(rhs, is_transposed);
            }
        }
    )*};
}

macro_rules! real_and_complex {
    ($($F:ident, $Complex:ident;)*) => {
        numbers! {$(
            $F: Reals<$F>, |sum, a, b| a.mul_add(b, sum),
                |x| a.mul_add(x, sum), |re, _im| re;
            $Complex: Complexes<$F>, |sum, a, b| Self {
                re: (-a.im).mul_add(b.im, a.re.mul_add(b.re, sum.re)),
                im: a.im.mul_add(b.re, a.re.mul_add(b.im, sum.im)),
            },
                |x| Self { re: a.re.mul_add(x, sum.re), im: a.im.mul_add(x, sum.im) },
                |re, im| Self { re: re.re - im.im, im: re.im + im.re };
        )*}
    };
}

real_and_complex! {
    f32, Complex32;
    f64, Complex64;
}

macro_rules! scalars {
    ($($T:ident: $Single:ident, $new_factors:ident, |$double:ident| $to_single:expr, |$single:ident| $from_single:expr;)*) => {$(
        impl Scalar for $T {
            type Single = $Single;

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation)] // intended
            fn to_single(self) -> $Single {
                let $double = self;
                $to_single
            }

            #[inline(always)]
            fn from_single($single: $Single) -> Self {
                $from_single
            }

            fn factors_of(
                engine: &dyn Engine,
                pattern: &Arc<SparsityPattern>,
                kind: Kind,
            ) -> Box<dyn Factorization<$T>> {
                engine.$new_factors(pattern, kind)
            }

            fn solve_columns_by_blocks(factors: &mut Supernodal<$T>, rhs: &mut [$T], n: usize) {
                factors.run(rhs, n, false);
            }

            fn subtract(product: &Product, values: &[$T], x: &[$T], y: &mut [$T]) {
                product.accumulate(values, x, y);
            }

            fn subtract_transposed(product: &Product, values: &[$T], x: &[$T], y: &mut [$T]) {
                product.transposed(values, x, y);
            }

            fn subtract_columns(product: &Product, values: &[$T], x: &[$T], y: &mut [$T], n: usize) {
                product.by_columns::<$T, false>(values, x, y, n);
            }

            fn subtract_transposed_columns(
                product: &Product,
                values: &[$T],
                x: &[$T],
                y: &mut [$T],
                n: usize,
            ) {
                product.by_columns::<$T, true>(values, x, y, n);
            }

            fn add_magnitudes(product: &Product, values: &[$T], x: &[$T], y: &mut [f64]) {
                product.magnitudes(values, x, y);
            }

            #[cfg(not(klu))]
            fn lu(symbolic: Symbolic) -> Lu<$T> {
                Lu::new(symbolic)
            }

            #[cfg(not(klu))]
            fn factor_lu(lu: &mut Lu<$T>, values: &[$T]) -> Option<()> {
                lu.factor(values)
            }

            #[cfg(not(klu))]
            fn solve_lu(lu: &mut Lu<$T>, x: &mut [$T], is_transposed: bool) {
                lu.solve(x, is_transposed);
            }
        }
    )*};
}

scalars! {
    f64: f32, real, |double| double as f32, |single| Self::from(single);
    Complex64: Complex32, complex,
        |double| Complex32::new(double.re as f32, double.im as f32),
        |single| Self::new(single.re.into(), single.im.into());
}

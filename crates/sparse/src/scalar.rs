//! The scalar type of a matrix: real for BDF, real and complex for Radau IIA.
//!
//! The loops over both types are instantiated in this crate. Generic code is otherwise compiled again
//! in each crate that calls it; every crate and test that solves a linear system would compile all
//! kernels for all instruction sets.

use std::ops::{AddAssign, Mul, MulAssign, SubAssign};
use std::sync::Arc;

use faer::traits::ComplexField;
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::{Complex64, ComplexFloat};

use crate::engine::Engine;
#[cfg(not(klu))]
use crate::lu::{Lu, Symbolic};
use crate::product::Product;
use crate::row::{Complexes, Reals, Row};
use crate::supernodal::Supernodal;
use crate::{Factorization, Kind, SparseError};

mod sealed {
    #[cfg(klu)]
    pub trait Sealed: crate::ffi::klu::Entry {}
    #[cfg(not(klu))]
    pub trait Sealed {}

    impl Sealed for f64 {}
    impl Sealed for super::Complex64 {}
}

/// The scalar type of a matrix: `f64` or `Complex64`.
///
/// The methods are used by this crate; they instantiate its kernels.
pub trait Scalar:
    sealed::Sealed
    + ComplexFloat<Real = f64>
    + ComplexField
    + Send
    + Sync
    + Mul<f64, Output = Self>
    + AddAssign
    + MulAssign
    + SubAssign
    + std::fmt::Debug
    + 'static
{
    /// A row of C right-hand sides, in vector registers.
    type Columns<const C: usize>: Row<Self>;

    /// Returns `self` + a b, with fused multiply-adds: one instruction if the processor has it.
    fn plus_product(self, a: Self, b: Self) -> Self;

    /// Allocates a matrix of this type and its factors in an `engine`.
    fn factors_of(
        engine: &dyn Engine,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Self>>;

    /// [`Supernodal::factor`].
    ///
    /// # Errors
    /// [`SparseError::ZeroPivot`].
    fn factor(factors: &mut Supernodal<Self>, values: &[Self]) -> Result<(), SparseError>;

    /// Solves with [`Supernodal`] factors.
    fn solve_by_blocks(
        factors: &mut Supernodal<Self>,
        rhs: &mut [Self],
        n_columns: usize,
        is_transposed: bool,
    );

    /// [`Product::subtract`].
    fn subtract(product: &Product, values: &[Self], x: &[Self], y: &mut [Self]);

    /// [`Product::subtract_transposed`].
    fn subtract_transposed(product: &Product, values: &[Self], x: &[Self], y: &mut [Self]);

    /// [`Product::subtract_columns`].
    fn subtract_columns(product: &Product, values: &[Self], x: &[Self], y: &mut [Self], n: usize);

    /// [`Product::subtract_transposed_columns`].
    fn subtract_transposed_columns(
        product: &Product,
        values: &[Self],
        x: &[Self],
        y: &mut [Self],
        n: usize,
    );

    /// [`Product::add_magnitudes`].
    fn add_magnitudes(product: &Product, values: &[Self], x: &[Self], y: &mut [f64]);

    /// [`Lu::new`].
    #[cfg(not(klu))]
    fn lu(symbolic: Symbolic) -> Lu<Self>;

    /// [`Lu::factor`].
    #[cfg(not(klu))]
    fn factor_lu(lu: &mut Lu<Self>, values: &[Self]) -> Option<()>;

    /// [`Lu::solve`].
    #[cfg(not(klu))]
    fn solve_lu(lu: &mut Lu<Self>, x: &mut [Self], is_transposed: bool);
}

macro_rules! scalars {
    ($($T:ident: $Columns:ident, $new_factors:ident, |$s:ident, $a:ident, $b:ident| $product:expr;)*) => {$(
        impl Scalar for $T {
            type Columns<const C: usize> = $Columns<C>;

            #[inline(always)]
            fn plus_product(self, $a: Self, $b: Self) -> Self {
                let $s = self;
                $product
            }

            fn factors_of(
                engine: &dyn Engine,
                pattern: &Arc<SparsityPattern>,
                kind: Kind,
            ) -> Box<dyn Factorization<$T>> {
                engine.$new_factors(pattern, kind)
            }

            fn factor(factors: &mut Supernodal<$T>, values: &[$T]) -> Result<(), SparseError> {
                factors.factor_by_blocks(values)
            }

            fn solve_by_blocks(
                factors: &mut Supernodal<$T>,
                rhs: &mut [$T],
                n_columns: usize,
                is_transposed: bool,
            ) {
                factors.run(rhs, n_columns, is_transposed);
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
    f64: Reals, real, |sum, a, b| a.mul_add(b, sum);
    Complex64: Complexes, complex, |sum, a, b| Self {
        re: (-a.im).mul_add(b.im, a.re.mul_add(b.re, sum.re)),
        im: a.im.mul_add(b.re, a.re.mul_add(b.im, sum.im)),
    };
}

//! The loops over numbers, compiled here and once for each number. What is generic is compiled again in each
//! crate that calls it: without this, every crate and every test that solves a linear system would compile all
//! of them, for all sets of instructions.

use num_complex::Complex64;

#[cfg(not(klu))]
use crate::partial::{Factors, Symbolic};
use crate::supernodal::Supernodal;
use crate::{Product, SparseError};
#[cfg(not(klu))]
use faer::dyn_stack::MemBuffer;

/// The loops for one number; what they do is said where they are called.
pub trait Compiled: Sized {
    /// [`Supernodal::factor`].
    ///
    /// # Errors
    /// [`SparseError::ZeroPivot`].
    fn factor(factors: &mut Supernodal<Self>, values: &[Self]) -> Result<(), SparseError>
    where
        Self: crate::Number;

    /// All solves of [`Supernodal`].
    fn solve_by_blocks(
        factors: &mut Supernodal<Self>,
        rhs: &mut [Self],
        n_columns: usize,
        is_transposed: bool,
    ) where
        Self: crate::Number;

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

    /// [`Factors::room`].
    #[cfg(not(klu))]
    fn room_for_lu(symbolic: &Symbolic) -> MemBuffer;

    /// [`Factors::factor`].
    #[cfg(not(klu))]
    fn factor_lu(factors: &mut Factors<Self>, values: &[Self]) -> Option<()>
    where
        Self: crate::Number;

    /// [`Factors::solve_with`].
    #[cfg(not(klu))]
    fn solve_lu(factors: &mut Factors<Self>, x: &mut [Self], is_transposed: bool)
    where
        Self: crate::Number;
}

macro_rules! compiled {
    ($($T:ty),*) => {$(
        impl Compiled for $T {
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
            fn room_for_lu(symbolic: &Symbolic) -> MemBuffer {
                Factors::<$T>::room(symbolic)
            }

            #[cfg(not(klu))]
            fn factor_lu(factors: &mut Factors<$T>, values: &[$T]) -> Option<()> {
                factors.factor(values)
            }

            #[cfg(not(klu))]
            fn solve_lu(factors: &mut Factors<$T>, x: &mut [$T], is_transposed: bool) {
                factors.solve_with(x, is_transposed);
            }
        }
    )*};
}

compiled!(f64, Complex64);

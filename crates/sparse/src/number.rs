//! The numbers a Newton matrix is made of: real for BDF, complex for Radau IIA.
//!
//! The loops over them are compiled here and once for each. What is generic is compiled again in each
//! crate that calls it: without this, every crate and every test that solves a linear system would compile all
//! of them, for all sets of instructions.

use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::arithmetic::Arithmetic;
use crate::engine::Engine;
#[cfg(not(klu))]
use crate::lu::{Lu, Symbolic};
use crate::product::Product;
use crate::supernodal::Supernodal;
use crate::{Factorization, Kind, SparseError};

/// `f64` or `Complex64`. What its loops do is said where they are called.
pub trait Number: Arithmetic {
    /// Room for matrices of these numbers and their factors in an `engine`.
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

macro_rules! numbers {
    ($($T:ident by $room:ident),*) => {$(
        impl Number for $T {
            fn factors_of(
                engine: &dyn Engine,
                pattern: &Arc<SparsityPattern>,
                kind: Kind,
            ) -> Box<dyn Factorization<$T>> {
                engine.$room(pattern, kind)
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

numbers!(f64 by real, Complex64 by complex);

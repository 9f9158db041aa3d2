//! Sparse direct factorizations of Newton matrices, real and complex.
//!
//! - [`supernodal`]: LU and LDLᵀ in dense blocks with fixed pivots, for matrices with a symmetric pattern.
//! - [`pivoting`]: LU with pivoting for any sparse matrix. Uses the system's [`klu`] if the feature `klu` is enabled
//!   and `vendored` is not; otherwise uses faer.
//! - [`SparseSystem`]: a supernodal factorization that checks its solutions and switches to pivoting if necessary.
//!
//! All of them implement [`Factorization`]. An external [`engine`] can provide another implementation. The feature
//! `metis` adds nested dissection to the fill-reducing orderings.
#![deny(unsafe_code)]

mod compiled;
mod dense;
mod elimination;
pub mod engine;
mod error;
mod factorization;
#[allow(unsafe_code)]
mod ffi;
mod finite;
pub mod klu;
#[cfg(not(klu))]
mod lu;
mod options;
mod ordering;
#[cfg(not(klu))]
mod partial;
pub mod pivoting;
mod product;
pub mod resources;
mod row;
mod scalar;
mod single;
pub mod supernodal;
mod system;
mod versions;
mod work;

pub use dense::DenseLu;
pub use elimination::{Elimination, Structure};
pub use error::SparseError;
pub use factorization::{Factorization, Kind, Prediction};
pub use ffi::allocator::Allocator;
pub use options::{Ordering, Precision, Scaling, SparseOptions};
pub use product::Product;
pub use scalar::{Number, Scalar};
pub use system::SparseSystem;
pub use versions::Versions;
pub use work::LinearWork;

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-factorizations.md")]
    pub mod factorizations {}
}

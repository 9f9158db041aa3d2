//! Sparse direct factorisations of Newton matrices, real and complex.
//!
//! - [`supernodal`]: LU and LDLᵀ in dense blocks with fixed pivots, for matrices with a symmetric
//!   pattern.
//! - [`pivoting`]: LU with exchange of pivots, for any sparse matrix: the system's [`klu`] with the
//!   feature of that name and without `vendored`, else faer's.
//! - [`SparseSystem`]: the former, checked, and the latter where that is not enough.
//!
//! All are [`Factorization`]s, and so is what an [`engine`] from outside offers. The feature `metis` adds nested dissection to the orders of
//! elimination.
#![deny(unsafe_code)]

mod compiled;
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
pub mod supernodal;
mod system;
mod versions;
mod work;

pub use error::SparseError;
pub use factorization::{Factorization, Kind, Prediction};
pub use options::{Ordering, Scaling, SparseOptions};
pub use product::Product;
pub use scalar::Scalar;
pub use system::{Elimination, SparseSystem, Structure};
pub use versions::Versions;
pub use work::LinearWork;

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-factorisations.md")]
    pub mod factorisations {}
}

//! Sparse direct factorisations of Newton matrices, real and complex.
//!
//! - [`klu`]: KLU, for any sparse matrix.
//! - [`supernodal`]: dense blocks with fixed pivots, for matrices with a symmetric pattern.
//! - [`SparseSystem`]: the latter, checked, and KLU where that is not enough.
#![deny(unsafe_code)]

#[allow(unsafe_code)]
mod ffi;
pub mod klu;
mod number;
mod product;
pub mod supernodal;
mod system;
mod versions;
mod work;

pub use number::Number;
pub use product::Product;
pub use system::{Elimination, SparseSystem};
pub use versions::Versions;
pub use work::LinearWork;

//! KLU, a sparse direct solver for unsymmetric, nearly block triangular systems.
//!
//! A pattern is analyzed once ([`Symbolic`]: ordering and block triangular form). Matrices with that pattern are then
//! factorized ([`Factors::renew`]) with the pivots of the previous matrix, as long as these pivots are accurate. Real
//! and complex matrices with the same pattern share one analysis. Refactorizations and solves do not allocate.
//!
//! This module is empty if the feature `klu` is disabled or `vendored` is enabled.
//!
//! # Examples
//! ```
//! # #[cfg(klu)] {
//! use nalgebra_sparse::pattern::SparsityPattern;
//! use myovib_sparse::SparseOptions;
//! use myovib_sparse::klu::{Factors, Symbolic};
//!
//! // A = [2 1; 0 4], stored by columns.
//! let pattern = SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 1, 3], vec![0, 0, 1])?;
//! let mut lu = Factors::new(Symbolic::analyze(&pattern, SparseOptions::default())?);
//! lu.renew(&[2.0, 1.0, 4.0])?;
//! let mut x = [4.0, 8.0];
//! lu.solve(&mut x)?;
//! assert_eq!(x, [1.0, 2.0]);
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # References
//! - T. A. Davis, E. Palamadai Natarajan, Algorithm 907: KLU, a direct sparse solver for circuit
//!   simulation problems, ACM Trans. Math. Softw. 37 (2010) 36.

#[cfg(klu)]
mod factors;
#[cfg(klu)]
mod symbolic;

#[cfg(klu)]
pub use factors::{Factors, Pivots};
#[cfg(klu)]
pub use symbolic::Symbolic;

//! LU factors of matrices with a symmetric pattern, by dense blocks and with pivots fixed.
//!
//! The Newton matrices of a solid come in blocks: the components of a node, and of all nodes that
//! are eliminated together, have the same rows. Columns with the same rows form a *supernode*;
//! eliminating one is dense arithmetic on a *front*, which the processor's vector unit does several
//! times faster than KLU's scalar loops over indices, and the factors hold one index per row of a
//! supernode instead of one per entry, so that solves move half the memory.
//!
//! The price: the pivots are the diagonal ones in the order of elimination, without exchange. For
//! κ < ∞ the matrices are quasi-definite up to the damping, and any order will do. For κ = ∞ the
//! pressures have zeros on the diagonal; they are put off until neighbours are eliminated, which
//! makes their pivots −b S⁻¹ bᵀ with S positive definite. What the pivots are worth is checked on the
//! solutions by the [caller](crate::SparseSystem), who falls back to KLU.
//!
//! Cast: [`Analysis`] is order, supernodes and places; [`Supernodal`] the numbers.
//!
//! # References
//! - I. S. Duff, J. K. Reid, The multifrontal solution of unsymmetric sets of linear equations,
//!   SIAM J. Sci. Stat. Comput. 5 (1984) 633–641.
//! - C. Ashcraft, R. Grimes, The influence of relaxed supernode partitions on the multifrontal
//!   method, ACM Trans. Math. Softw. 15 (1989) 291–309.

mod analysis;
mod child;
mod factors;
mod large;
mod narrow;
mod partition;
mod rooms;
mod schedule;
mod shared;
mod small;
mod solve;
mod update;

pub use analysis::Analysis;
pub use factors::Supernodal;

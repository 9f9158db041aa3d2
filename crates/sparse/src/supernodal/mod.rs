//! LU factorization of matrices with a symmetric pattern, in dense blocks and with fixed pivots.
//!
//! The Newton matrices of a solid consist of blocks, because the components of a node have the same rows, and so do all
//! nodes eliminated together. Columns with the same rows form a *supernode*. Its elimination is dense
//! arithmetic on a *front*, which vector instructions execute several times faster than the indexed scalar loops of
//! KLU. The factors store one index per row of a supernode instead of one per entry, so solves move half as much
//! memory.
//!
//! The pivots are the diagonal entries in the order of elimination; there is no pivoting. If κ is finite, the matrices
//! are quasi-definite except for the damping, and any order is valid. If κ = ∞, the diagonal entries of the pressures
//! are zero. Pressures are delayed until neighbors are eliminated; their pivots are then −b S⁻¹ bᵀ with S positive
//! definite. [`SparseSystem`](crate::SparseSystem) checks the accuracy of the solutions and switches to pivoting if
//! necessary.
//!
//! [`Analysis`] contains the order, the supernodes and the positions; [`Supernodal`] contains the numerical factors.
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
mod large_solve;
mod narrow;
mod partition;
mod schedule;
mod small;
mod solve;
#[cfg(test)]
mod tests;
mod update;
mod workspace;

pub use analysis::Analysis;
pub use factors::Supernodal;

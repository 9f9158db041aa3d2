//! Distributed runs on one or several machines.
//!
//! Rank 0 integrates, makes all decisions and writes the output. In each pass over the elements, every rank computes
//! its share, and the shares are summed at rank 0. MUMPS factorizes and solves on all ranks; each rank stores a part of
//! the factors. Rank 0 broadcasts each command together with the state to which it applies. All processes therefore use
//! the same state, regardless of the processors and of the order in which MPI computes sums.
//!
//! All ranks have equal numbers of elements, and the location of the elements does not matter. The vectors that are
//! summed always have full length, so a partition with small interfaces would not reduce the communication.
//!
//! `begin` returns the role of this process: a `Session` with its `Sharing` at rank 0, otherwise a `Follower`. The
//! module `call` defines the messages, `passes` distributes passes over the elements
//! ([`myovib_fem::ParallelAssembler`]), `factors` factorizes matrices ([`myovib_sparse::engine::Engine`]), and `ffi`
//! contains the interface to C.
//!
//! The crate is empty without the feature `mpi`.
//!
//! # References
//! - P. R. Amestoy, I. S. Duff, J. Koster, J.-Y. L'Excellent, A fully asynchronous multifrontal solver using
//!   distributed dynamic scheduling, SIAM J. Matrix Anal. Appl. 23 (2001) 15–41.
#![deny(unsafe_code)]

#[cfg(feature = "mpi")]
mod call;
#[cfg(feature = "mpi")]
mod factors;
#[cfg(feature = "mpi")]
#[allow(unsafe_code)]
mod ffi;
#[cfg(feature = "mpi")]
mod follower;
#[cfg(feature = "mpi")]
mod leader;
#[cfg(feature = "mpi")]
mod passes;
#[cfg(feature = "mpi")]
mod session;

#[cfg(feature = "mpi")]
pub use follower::Follower;
#[cfg(feature = "mpi")]
pub use session::{Role, Session, Sharing, begin};

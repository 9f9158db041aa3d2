//! One run by several processes, of one machine or of many.
//!
//! Rank 0 integrates, decides and writes, as it would alone. The others lend a hand: they compute
//! their shares of each pass over the elements, whose sums go to rank 0, and they hold their parts
//! of the factors, which MUMPS computes and solves with. What rank 0 has them do, it broadcasts:
//! a command, and the state it is to be done at. So no process can disagree with another, whatever the
//! order in which MPI sums and whatever the processor of each machine.
//!
//! Shares are equal numbers of elements, wherever these lie: the sums go to rank 0 as whole vectors, so that
//! parts of the mesh with small surfaces between them would save nothing.
//!
//! Cast: `begin` tells whether this process is rank 0, with a `Session` and its `Sharing`, or a
//! `Follower`. `call` is what goes from one to the other, `crew` shares out passes
//! ([`myovib_fem::Crew`]), `factors` factorizes ([`myovib_sparse::engine::Engine`]), `ffi` is the
//! boundary.
//!
//! All of it is behind the feature `mpi`; without, the crate is empty.
//!
//! # References
//! - P. R. Amestoy, I. S. Duff, J. Koster, J.-Y. L'Excellent, A fully asynchronous multifrontal solver using
//!   distributed dynamic scheduling, SIAM J. Matrix Anal. Appl. 23 (2001) 15–41.
#![deny(unsafe_code)]

#[cfg(feature = "mpi")]
mod call;
#[cfg(feature = "mpi")]
mod crew;
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
mod session;

#[cfg(feature = "mpi")]
pub use follower::Follower;
#[cfg(feature = "mpi")]
pub use session::{Role, Session, Sharing, begin};

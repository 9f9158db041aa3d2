//! The boundary to MPI and to MUMPS.

mod mumps;
mod world;

pub(crate) use mumps::{Matrix, Scalar};
pub(crate) use world::World;

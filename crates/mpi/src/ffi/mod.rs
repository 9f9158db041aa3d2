//! The boundary to MPI and to MUMPS.

mod mumps;
mod world;

pub(crate) use mumps::{Matrix, MumpsScalar};
pub(crate) use world::World;

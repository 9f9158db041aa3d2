//! C interface to MPI and MUMPS.

mod mumps;
mod world;

pub(crate) use mumps::{Matrix, MumpsScalar};
pub(crate) use world::World;

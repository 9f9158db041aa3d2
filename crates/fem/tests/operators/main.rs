//! Tests of the operators through the public interface: differences, identities, convergence,
//! published values.
#![allow(clippy::unwrap_used, reason = "tests are exempt")]

mod added;
mod common;
mod convergence;
mod convergence_in_space;
mod curved;
mod differences;
mod enclosed;
mod follower;
mod graded;
mod identities;
mod meshes;
mod objectivity;
mod points;
mod powers;
mod relaxing;
mod shared;
mod spatial;
mod statics;

//! Tests of the operators through the public interface: differences, identities, convergence and published values.
#![allow(clippy::unwrap_used, reason = "tests are exempt")]

mod added;
mod common;
mod convergence;
mod convergence_in_space;
mod curved;
mod differences;
mod element_scales;
mod enclosed;
mod follower;
mod identities;
mod meshes;
mod objectivity;
mod partition;
mod points;
mod powers;
mod relaxation;
mod spatial;
mod statics;
mod volume_functions;

//! Loads, motions and stiffness that vary in space.
#![allow(clippy::unwrap_used)] // a test may panic

mod body_forces;
mod common;
mod displacements;
mod fields;
mod materials;
mod point_forces;
mod refusals;
mod tractions;

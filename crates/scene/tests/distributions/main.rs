//! Loads and motions that vary in space.
#![allow(clippy::unwrap_used)] // a test may panic

mod body_forces;
mod common;
mod displacements;
mod fields;
mod refusals;
mod tractions;

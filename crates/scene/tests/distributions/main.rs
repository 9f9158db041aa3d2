//! Loads and motions that vary from place to place.
#![allow(clippy::unwrap_used)] // a test may panic

mod body_forces;
mod common;
mod displacements;
mod fields;
mod refusals;
mod tractions;

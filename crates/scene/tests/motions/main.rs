//! Dynamic scenes: initial states, and loads that jump.
#![allow(clippy::unwrap_used)] // a test may panic

mod acceleration;
mod common;
mod free;
mod jumps;
mod start;

//! Loads that change abruptly: none is stepped over, and those that jump start the method anew.
#![allow(clippy::unwrap_used)] // a test may panic

mod common;
mod jumps;
mod seen;

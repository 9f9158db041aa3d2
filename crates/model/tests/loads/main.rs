//! Loads that change abruptly: no load is stepped over, and a jump restarts the method.
#![allow(clippy::unwrap_used)] // a test may panic

mod common;
mod jumps;
mod seen;

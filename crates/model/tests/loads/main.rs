//! Loads that change abruptly: steps must not pass over a load, and a jump restarts the method.
#![allow(clippy::unwrap_used)] // a test may panic

mod common;
mod jumps;
mod seen;

//! Finite elements of the muscle and of the rod.
#![forbid(unsafe_code)]

pub mod rod;

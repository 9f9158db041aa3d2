//! Tests of the checks of problems, with samples that have exact Jacobians and patterns.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod jacobians;
mod patterns;

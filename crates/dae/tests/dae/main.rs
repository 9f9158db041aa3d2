//! Tests of `check_jacobian` and `check_pattern` with samples that have exact Jacobians and patterns.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod jacobians;
mod patterns;

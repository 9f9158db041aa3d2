//! Checks of problems, on samples with exact Jacobians and patterns.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod jacobians;
mod patterns;

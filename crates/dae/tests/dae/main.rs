//! Checks of problems, applied to samples with exact Jacobians and patterns.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod jacobians;
mod patterns;

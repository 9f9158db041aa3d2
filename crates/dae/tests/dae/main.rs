//! Checks of problems, on samples with exact Jacobians and patterns.

mod jacobians;
mod patterns;

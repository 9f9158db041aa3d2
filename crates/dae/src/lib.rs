//! Differential-algebraic equations F(t, y, ẏ) = 0: what a problem says of itself, and what any
//! integrator answers. Pure Rust; no integrator, no linear algebra of its own.
//!
//! # Cast of types
//! - [`Problem`]: what you write: residual, Jacobian in a fixed sparse pattern, and what each
//!   variable is.
//! - [`Tolerances`], [`Suppressed`], [`Direction`]: what is asked of an integrator.
//! - [`StructuredSolver`]: a linear solver that knows more than a pattern.
//! - [`Outcome`], [`Stop`], [`Stats`]: what an integrator answers.
//! - [`samples`]: test problems with exact solutions.
#![forbid(unsafe_code)]

mod direction;
mod linear_solver;
mod outcome;
mod problem;
pub mod samples;
mod statistics;
mod tolerances;

pub use direction::Direction;
pub use linear_solver::StructuredSolver;
/// The pattern of a sparse matrix, as [`Problem::jacobian_pattern`] states it.
pub use nalgebra_sparse::pattern::SparsityPattern;
pub use outcome::{Outcome, Stop, StopReason, WorstComponent};
pub use problem::{Problem, StepError, VariableKind};
pub use statistics::Stats;
pub use tolerances::{Suppressed, Tolerances};

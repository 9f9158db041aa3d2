//! Interfaces of problems and integrators for differential-algebraic equations F(t, y, ẏ) = 0. This crate is pure Rust.
//! It contains neither integrators nor linear algebra.
//!
//! # Types
//! - [`Problem`]: the interface that a model implements. It consists of the residual and, optionally, the Jacobian in a
//!   fixed sparse pattern and the kind of each variable.
//! - [`Jacobian`]: evaluates the exact Jacobian of a problem, or difference quotients, at a [`Linearization`].
//!   [`kinds_at`] determines the kind of each variable, and [`check_pattern`] detects entries missing in the pattern
//!   of the Jacobian.
//! - [`Parameters`]: parameters of a problem, and ∂F/∂p.
//! - [`LinearSolver`]: solves the linear systems of Newton's method, with real and complex shifts.
//! - [`Tolerances`], [`Suppressed`], [`Direction`], [`ConsistencyMode`]: settings of an [`Integrator`].
//! - [`Outcome`], [`Stop`], [`Statistics`], [`IntegratorError`]: results of an integrator. [`checks`] validates its
//!   arguments.
#![forbid(unsafe_code)]

mod between;
pub mod checks;
mod coloring;
pub mod columns;
mod consistent;
mod differences;
mod direction;
mod draw;
mod inconsistent;
mod integrator;
mod integrator_error;
mod jacobian;
mod kinds;
mod linear_solver;
mod linearization;
mod outcome;
mod parameters;
mod pattern;
mod problem;
mod projection;
mod remedy;
mod start;
mod statistics;
mod stop_reason;
mod tolerances;
mod wrong_entry;

pub use between::{Unsatisfied, check_between};
pub use consistent::{correct_initial_values, expect_index};
pub use direction::Direction;
pub use inconsistent::Inconsistent;
pub use integrator::{ConsistencyMode, Integrator, covers};
pub use integrator_error::IntegratorError;
pub use jacobian::Jacobian;
pub use kinds::kinds_at;
pub use linear_solver::LinearSolver;
pub use linearization::Linearization;
/// The pattern of a sparse matrix, used by [`Problem::jacobian_pattern`].
pub use nalgebra_sparse::pattern::SparsityPattern;
/// Type of the complex shifts and right-hand sides of a [`LinearSolver`].
pub use num_complex::Complex64;
pub use outcome::{Outcome, Stop, WorstComponent};
pub use parameters::{Differenced, Parameter, Parameters};
pub use pattern::{MissingEntry, check_pattern};
pub use problem::{Problem, StepError, VariableKind, full_pattern};
pub use projection::project_onto_constraints;
pub use remedy::Remedy;
pub use start::{InconsistentStart, check_start};
pub use statistics::{Statistics, Work};
pub use stop_reason::StopReason;
pub use tolerances::{NoIndices, Suppressed, Tolerances, UNTESTED};
pub use wrong_entry::{WrongEntry, check_jacobian};

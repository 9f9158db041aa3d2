//! A safe wrapper of the SUNDIALS integrator IDAS for differential-algebraic equations.

#![deny(unsafe_code)]

#[allow(unsafe_code)]
mod ffi;
pub mod klu;
pub mod problem;

pub use problem::{DaeProblem, StepError, VariableKind};

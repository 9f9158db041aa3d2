//! A safe wrapper of the SUNDIALS integrator IDAS for differential-algebraic equations.

pub mod problem;

pub use problem::{DaeProblem, StepError, VariableKind};

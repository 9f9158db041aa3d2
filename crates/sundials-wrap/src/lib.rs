//! A safe wrapper of the SUNDIALS integrator IDAS for differential-algebraic equations.

#![deny(unsafe_code)]

mod error;
#[allow(unsafe_code)]
mod ffi;
pub mod klu;
pub mod options;
mod outcome;
pub mod problem;
pub mod samples;
mod solver;
mod stats;
mod structured;
mod versions;

pub use error::Error;
pub use options::{Constraint, Direction, IdaOptions, Suppressed, Tolerances};
pub use outcome::{Outcome, Stop, StopReason, WorstComponent};
pub use problem::{DaeProblem, StepError, VariableKind};
pub use solver::{ConsistencyMode, IdaBuilder, IdaSolver};
pub use stats::Stats;
pub use structured::StructuredSolver;
pub use versions::Versions;

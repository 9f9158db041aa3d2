//! A safe wrapper of the SUNDIALS integrator IDAS, with sparse Jacobians factorized by KLU or faer,
//! for implicit differential-algebraic equations F(t, y, ẏ) = 0.
//!
//! # Main types
//! - [`Problem`]: the system to implement: residual, Jacobian in a fixed sparse pattern, and the
//!   kind of each variable.
//! - [`IdaBuilder`] takes a problem, [`IdaOptions`] and functions (roots, quadratures, error
//!   weights, a [`LinearSolver`]) and builds an [`IdaSolver`].
//! - [`IdaSolver`] owns the problem and takes steps ([`IdaSolver::step`]) or integrates
//!   ([`IdaSolver::integrate_to`]).
//! - [`Outcome`]: output time reached, stop time, root, or [`Stop`]: integration stopped, with
//!   reason, [`Statistics`] and the components with the largest errors. [`Error`] is for misuse and
//!   for fatal errors of user functions.
//! - [`adjoint`]: backward problems along the solution, for gradients with respect to many
//!   parameters.
//! - [`klu`]: sparse LU factors of real and complex matrices, for other solvers.
//!
//! # Examples
//! Robertson's kinetics to t = 40:
//! ```
//! use myovib_conformance::samples::{Robertson, Sample};
//! use myovib_dae::{Outcome, Tolerances};
//! use sundials_wrap::IdaSolver;
//!
//! let start = Robertson.start();
//! let mut solver = IdaSolver::builder(Robertson)
//!     .tolerances(Tolerances::vector(1e-6, [1e-10, 1e-12, 1e-10]))
//!     .build(start.t, &start.y, &start.y_dot)?;
//! match solver.integrate_to(40.0)? {
//!     Outcome::Stopped(stop) => panic!("{stop}"),
//!     outcome => assert_eq!(outcome, Outcome::Reached { t: 40.0 }),
//! }
//! assert!((solver.y()[0] - 0.715827).abs() < 1e-5);
//! assert!(solver.statistics().steps > 50);
//! # Ok::<(), sundials_wrap::Error>(())
//! ```
//! A custom problem in fifty lines: `examples/your_own_dae.rs`.
//!
//! # References
//! - A. C. Hindmarsh et al., SUNDIALS: suite of nonlinear and differential/algebraic equation
//!   solvers, ACM Trans. Math. Softw. 31 (2005) 363.

#![deny(unsafe_code)]

pub mod adjoint;
mod error;
#[allow(unsafe_code)]
mod ffi;
mod options;
mod solver;
mod vector_kernels;
mod versions;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-life-cycle.md")]
    pub mod life_cycle {}
}

pub use error::Error;
/// The problem trait and the common interface of the integrators.
pub use myovib_dae::{
    ConsistencyMode, Direction, Integrator, IntegratorError, Jacobian, LinearSolver, Linearization,
    Outcome, Problem, SparsityPattern, Statistics, StepError, Stop, StopReason, Suppressed,
    Tolerances, VariableKind, WorstComponent,
};
/// KLU, whose settings are part of the integrator's settings.
pub use myovib_sparse::klu;
pub use options::{Constraint, IdaOptions, VectorArithmetic};
pub use solver::{
    IdaBuilder, IdaSolver, SensitivityMethod, SensitivityOptions, SensitivityStatistics,
};
pub use versions::Versions;

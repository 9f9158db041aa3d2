//! A safe wrapper for the SUNDIALS integrator IDAS, for implicit differential-algebraic equations F(t, y, ẏ) = 0.
//! Sparse Jacobians are factorized by KLU or faer.
//!
//! # Main types
//! - [`Problem`]: the system to be integrated. It consists of a residual, a Jacobian in a fixed sparse pattern, and the
//!   kind of each variable.
//! - [`IdaBuilder`] builds an [`IdaSolver`] from a problem, [`IdaOptions`] and functions (roots, quadratures, error
//!   weights, a [`LinearSolver`]).
//! - [`IdaSolver`] owns the problem and takes steps ([`IdaSolver::step`]) or integrates to a given time
//!   ([`IdaSolver::integrate_to`]).
//! - [`Outcome`]: the result of a call. An output time, a stop time or a root was reached, or the integration stopped.
//!   In the last case, a [`Stop`] contains the reason, the [`Statistics`] and the components with the largest errors.
//!   An [`Error`] is returned only for misuse and for fatal errors of user functions.
//! - [`adjoint`]: backward problems along the solution, for gradients with respect to many parameters.
//! - [`klu`]: sparse LU factors of real and complex matrices, for use in other solvers.
//!
//! # Examples
//! Robertson's kinetics, integrated to t = 40:
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
//! The example `examples/your_own_dae.rs` implements a custom problem in fifty lines.
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
/// The problem trait and the common integrator interface.
pub use myovib_dae::{
    ConsistencyMode, Direction, Integrator, IntegratorError, Jacobian, LinearSolver, Linearization,
    Outcome, Problem, SparsityPattern, Statistics, StepError, Stop, StopReason, Suppressed,
    Tolerances, VariableKind, WorstComponent,
};
/// KLU, whose settings are part of the integrator settings.
pub use myovib_sparse::klu;
pub use options::{Constraint, IdaOptions, VectorArithmetic};
pub use solver::{
    IdaBuilder, IdaSolver, SensitivityMethod, SensitivityOptions, SensitivityStatistics,
};
pub use versions::Versions;

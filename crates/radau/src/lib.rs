//! Radau IIA methods for fully implicit differential-algebraic equations F(t, y, ẏ) = 0.
//!
//! [`RadauSolver`] integrates any [`Problem`](myovib_dae::Problem) by an implicit Runge–Kutta method with adaptive
//! steps. The default method has 3 stages and order 5; methods with 1, 5 and 7 stages are also available. All these
//! methods are L-stable, whereas BDF methods above order 2 are unstable for undamped oscillations. Radau IIA methods
//! can also integrate constrained mechanical systems in their index-3 form.
//!
//! Main types: [`Method`] contains the coefficients. `NewtonSolver` solves the stage equations with a
//! [`LinearSolver`](myovib_dae::LinearSolver) ([`SparseDirectSolver`] by default), starting from the initial guess of a
//! `Predictor`. `ErrorTest` estimates the error, and `Control` selects the step size. `Collocation` is the polynomial
//! used for dense output, and `Roots` locates events on this polynomial. [`ForwardSensitivities`] follows the steps and
//! differentiates the solution with respect to parameters. Options, outcomes and statistics have the same form and
//! names as for IDAS.
//!
//! # Examples
//! ```
//! use myovib_dae::{Outcome, Problem, StepError, Tolerances};
//! use myovib_radau::RadauSolver;
//!
//! /// ẏ + 50 (y − cos t) = 0
//! struct Relaxation;
//!
//! impl Problem for Relaxation {
//!     fn n_unknowns(&self) -> usize {
//!         1
//!     }
//!     fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
//!         r[0] = v[0] + 50.0 * (y[0] - t.cos());
//!         Ok(())
//!     }
//! }
//!
//! let mut solver = RadauSolver::builder(Relaxation)
//!     .tolerances(Tolerances::scalar(1e-6, 1e-9))
//!     .build(0.0, &[0.0], &[50.0])?;
//! assert_eq!(solver.integrate_to(2.0)?, Outcome::Reached { t: 2.0 });
//! let exact = (2500.0 * 2f64.cos() + 50.0 * 2f64.sin()) / 2501.0;
//! assert!((solver.y()[0] - exact).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # References
//! - E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed., 1996: IV.8
//!   (implementation), VII.7 (index 2 and 3).
//! - K. Gustafsson, Control-theoretic techniques for stepsize selection in implicit Runge–Kutta
//!   methods, ACM Trans. Math. Softw. 20 (1994) 496.
#![forbid(unsafe_code)]

mod control;
mod dense;
mod error;
mod error_test;
mod failure;
mod internal_variables;
mod interpolation;
mod matrices;
mod method;
mod multipliers;
mod newton;
mod options;
mod predictor;
mod quadrature;
mod roots;
mod rounding;
mod sensitivity;
mod solver;
mod stage_system;
mod weights;
mod work;

pub use error::RadauError;
pub use internal_variables::{
    InternalVariableGroup, InternalVariableProblem, InternalVariables, RelaxationTerm,
};
pub use matrices::SparseDirectSolver;
pub use method::{ComplexMode, Method, RealMode};
/// Counters of the linear algebra.
pub use myovib_dae::Work;
pub use options::{IndexScaling, RadauOptions, StepSize};
pub use sensitivity::{
    Adjoint, AdjointWork, Cotangents, ForwardSensitivities, Gradient, Recording, SensitivityWork,
};
pub use solver::{RadauBuilder, RadauSolver, RadauState};

#[cfg(doctest)]
#[doc = include_str!("../../dae/README.md")]
struct ReadmeOfDae;

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-method.md")]
    pub mod method {}
}

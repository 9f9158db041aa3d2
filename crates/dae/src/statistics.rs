//! Counters of an integration.

use std::ops::Add;

use serde::{Deserialize, Serialize};

/// Counters of an integration since the start or the last reinitialization.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Steps rejected by the local error test (`IDAGetNumErrTestFails`).
    pub error_test_failures: u64,
    /// Steps abandoned because the nonlinear system could not be solved (`IDAGetNumStepSolveFails`).
    pub step_solve_failures: u64,
    /// Convergence failures of Newton's method, including failures after which the method succeeded with a new Jacobian
    /// (`IDAGetNumNonlinSolvConvFails`).
    pub newton_failures: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Evaluations of the residual, excluding evaluations for difference quotients.
    pub residual_evaluations: u64,
    /// Evaluations of the residual for Jacobians from difference quotients.
    pub difference_evaluations: u64,
    /// Evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
    /// Setups of the linear solver.
    pub linear_setups: u64,
    /// Backtracks of the line search for consistent initial values.
    pub backtracks: u64,
    /// Evaluations of the root functions.
    pub root_evaluations: u64,
    /// Evaluations of the integrands of the quadratures.
    pub quadrature_evaluations: u64,
    /// Steps rejected because of the quadratures.
    pub quadrature_error_test_failures: u64,
    /// Order of the last step.
    pub last_order: usize,
    /// Order of the next step.
    pub current_order: usize,
    /// Size of the last step.
    pub last_step: f64,
    /// Size of the next step.
    pub current_step: f64,
    /// Size of the first step.
    pub initial_step: f64,
    /// Time reached internally, which may be beyond the time of the last output.
    pub t_reached: f64,
    /// Factor by which the tolerances should be increased if they are too tight for machine precision.
    pub tolerance_scale_factor: f64,
    /// Return code of the last call of the linear solver.
    pub last_linear_flag: i64,
    /// Smallest reciprocal condition number estimated by KLU after a factorization. `None` before the first
    /// factorization, or if KLU is not used.
    pub smallest_rcond: Option<f64>,
    /// Work of the linear algebra for methods with complex matrices; `None` for other methods.
    pub work: Option<Work>,
}

/// Work of the linear algebra for an implicit Runge–Kutta method of s stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Work {
    /// Real factorizations: one per linear setup.
    pub real_factorizations: u64,
    /// Complex factorizations: (s − 1)/2 per linear setup.
    pub complex_factorizations: u64,
    /// Real solves: one per Newton iteration, and one or two per error estimate.
    pub real_solves: u64,
    /// Complex solves: (s − 1)/2 per Newton iteration.
    pub complex_solves: u64,
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            real_factorizations: self.real_factorizations + other.real_factorizations,
            complex_factorizations: self.complex_factorizations + other.complex_factorizations,
            real_solves: self.real_solves + other.real_solves,
            complex_solves: self.complex_solves + other.complex_solves,
        }
    }
}

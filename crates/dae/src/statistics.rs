//! The counters of an integration.

/// All that IDAS counts, since the start or the last re-initialisation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stats {
    /// Accepted steps.
    pub steps: u64,
    /// Steps rejected by the local error test (`IDAGetNumErrTestFails`).
    pub error_test_failures: u64,
    /// Steps lost because the nonlinear system could not be solved (`IDAGetNumStepSolveFails`).
    pub step_solve_failures: u64,
    /// Newton iterations that did not converge, including those repeated successfully with a fresh
    /// Jacobian (`IDAGetNumNonlinSolvConvFails`).
    pub newton_failures: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Evaluations of the residual.
    pub residual_evaluations: u64,
    /// Evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
    /// Set-ups of the linear solver.
    pub linear_setups: u64,
    /// Backtracks of the line search for consistent initial values.
    pub backtracks: u64,
    /// Evaluations of the root functions.
    pub root_evaluations: u64,
    /// Evaluations of the quadratures' integrands.
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
    /// Internal time reached, at or beyond the time of the last output.
    pub t_reached: f64,
    /// Factor by which the tolerances should be raised when they ask for too much accuracy.
    pub tolerance_scale_factor: f64,
    /// Return code of the last call of the linear solver.
    pub last_linear_flag: i64,
    /// The smallest reciprocal condition number that KLU estimated when it refactorised with kept
    /// pivots (below ε^(2/3) SUNDIALS may choose new ones). `None` before, and without KLU.
    pub smallest_rcond: Option<f64>,
}

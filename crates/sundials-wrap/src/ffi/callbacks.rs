//! Safe side of the interface to C: callbacks of IDAS and their return codes.
//!
//! The codes are 0 for success, +1 for a recoverable error (IDAS may try a smaller step), and −1 for an unrecoverable
//! error.

use std::os::raw::c_int;

/// Result of a callback, returned to IDAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Continue.
    Success,
    /// Try again with a smaller step.
    Recoverable,
    /// Stop.
    Fatal,
}

impl Answer {
    pub(super) fn code(self) -> c_int {
        match self {
            Self::Success => 0,
            Self::Recoverable => 1,
            Self::Fatal => -1,
        }
    }
}

/// Result of the convergence test after an iteration of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Convergence {
    /// The error is below the tolerance.
    Converged,
    /// Another iteration is necessary.
    Continue,
    /// Try again with a new matrix or a smaller step.
    Failed,
}

/// An iterate of Newton's method.
pub(crate) struct NewtonIterate {
    /// Number of iterations before this one.
    pub(crate) number: usize,
    /// Weighted norm of the last correction.
    pub(crate) correction: f64,
    /// Allowed error in the same norm.
    pub(crate) tolerance: f64,
}

/// Callbacks of IDAS.
pub(crate) trait Callbacks: BackwardCallbacks {
    fn residual(&mut self, t: f64, y: &[f64], y_dot: &[f64], residual: &mut [f64]) -> Answer;
    /// Evaluates and factorizes the Newton matrix ∂F/∂y + c_j ∂F/∂ẏ.
    fn linear_setup(&mut self, t: f64, y: &[f64], y_dot: &[f64], c_j: f64) -> Answer;
    /// Solves in place with the last factorized matrix.
    fn linear_solve(&mut self, rhs: &mut [f64]) -> Answer;
    /// Tests an iterate of Newton's method.
    fn convergence(&mut self, iterate: &NewtonIterate) -> Convergence;
    fn n_roots(&self) -> usize;
    fn roots(&mut self, t: f64, y: &[f64], y_dot: &[f64], values: &mut [f64]) -> Answer;
    fn error_weights(&mut self, y: &[f64], weights: &mut [f64]) -> Answer;
    fn quadrature(&mut self, t: f64, y: &[f64], y_dot: &[f64], rates: &mut [f64]) -> Answer;
    /// Evaluates ∂F/∂y and ∂F/∂ẏ for the residuals of sensitivities.
    fn linearize(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Answer;
    /// Evaluates the residual of the sensitivity to parameter j at the state of the last
    /// linearization.
    fn sensitivity_residual(
        &mut self,
        j: usize,
        at: (f64, &[f64], &[f64]),
        s: [&[f64]; 2],
        residual: &mut [f64],
    ) -> Answer;
    /// Evaluates the time derivatives of the sensitivities of the quadratures to parameter j.
    fn quadrature_sensitivity(
        &mut self,
        j: usize,
        at: (f64, &[f64], &[f64]),
        s: [&[f64]; 2],
        rates: &mut [f64],
    ) -> Answer;
    /// Receives a message from IDAS.
    fn message(&mut self, text: &str);
}

/// Forward solution at the state of a backward evaluation: y, ẏ, and S and Ṡ for each parameter.
pub(crate) struct ForwardView<'a> {
    pub(crate) t: f64,
    pub(crate) y: &'a [f64],
    pub(crate) y_dot: &'a [f64],
    pub(crate) s: Vec<[&'a [f64]; 2]>,
}

/// Functions that IDAS calls for the backward problem with index `which`. The argument `[y, ẏ]` contains the values of
/// this problem.
pub(crate) trait BackwardCallbacks {
    fn backward_residual(
        &mut self,
        which: usize,
        forward: &ForwardView<'_>,
        values: [&[f64]; 2],
        residual: &mut [f64],
    ) -> Answer;
    /// Evaluates and factorizes the Newton matrix of a backward problem.
    fn backward_setup(
        &mut self,
        which: usize,
        forward: &ForwardView<'_>,
        values: [&[f64]; 2],
        c_j: f64,
    ) -> Answer;
    /// Solves in place with the last factorized matrix of a backward problem.
    fn backward_solve(&mut self, which: usize, rhs: &mut [f64]) -> Answer;
    fn backward_quadrature(
        &mut self,
        which: usize,
        forward: &ForwardView<'_>,
        values: [&[f64]; 2],
        rates: &mut [f64],
    ) -> Answer;
}

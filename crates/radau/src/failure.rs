//! What can fail in a step, and what that means for it.

use myovib_dae::{StepError, StopReason};

use crate::error::RadauError;

/// A function of the problem, or an operation of its linear algebra.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operation {
    Residual,
    Jacobian,
    LinearSetUp,
    LinearSolve,
    RootFunction,
    ErrorWeights,
}

impl Operation {
    /// What an error of this operation means, for `map_err`: a recoverable one halves the step, a
    /// fatal one ends the integration.
    pub(crate) fn failed(self) -> impl FnOnce(StepError) -> Failure {
        move |error| match error {
            StepError::Recoverable(message) => Failure::Rejected(Rejection {
                reason: self.stop_reason(),
                message,
                step_factor: 0.5,
            }),
            StepError::Fatal(source) => Failure::Fatal(Fatal {
                function: self.name(),
                source,
            }),
            other => Failure::Fatal(Fatal {
                function: self.name(),
                source: other.into(),
            }),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Residual => "residual",
            Self::Jacobian => "Jacobian",
            Self::LinearSetUp => "linear set-up",
            Self::LinearSolve => "linear solve",
            Self::RootFunction => "root function",
            Self::ErrorWeights => "error weight function",
        }
    }

    /// Why an integration stops when this goes on failing.
    fn stop_reason(self) -> StopReason {
        match self {
            Self::Residual => StopReason::ResidualFailed,
            Self::Jacobian => StopReason::JacobianFailed,
            Self::LinearSetUp => StopReason::LinearSetupFailed,
            Self::LinearSolve => StopReason::LinearSolveFailed,
            Self::RootFunction => StopReason::RootFunctionFailed,
            Self::ErrorWeights => StopReason::ErrorWeightsFailed,
        }
    }
}

/// Why an attempt at a step came to nothing.
#[derive(Debug)]
pub(crate) enum Failure {
    Rejected(Rejection),
    Fatal(Fatal),
}

/// What a smaller step may repair.
#[derive(Debug)]
pub(crate) struct Rejection {
    pub(crate) reason: StopReason,
    pub(crate) message: String,
    /// The factor on h for the next attempt.
    pub(crate) step_factor: f64,
}

/// What cannot be repaired by a smaller step.
#[derive(Debug)]
pub(crate) struct Fatal {
    function: &'static str,
    source: Box<dyn std::error::Error + Send + Sync>,
}

impl Fatal {
    /// The error of a step of size `h` from `t`.
    pub(crate) fn in_step(self, t: f64, h: f64) -> RadauError {
        let Self { function, source } = self;
        RadauError::Fatal {
            function,
            t,
            h,
            source,
        }
    }
}

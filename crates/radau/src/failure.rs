//! What can fail in a step, and what that means for it.

use myovib_dae::{Statistics, StepError, StopReason};

use crate::error::RadauError;
use crate::options::RadauOptions;

/// A function of the problem, or an operation of its linear algebra.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operation {
    Residual,
    Jacobian,
    LinearSetUp,
    LinearSolve,
    RootFunction,
    ErrorWeights,
    Quadrature,
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
            Self::Quadrature => "quadrature",
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
            Self::Quadrature => StopReason::QuadratureFailed,
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
    /// The error as it was raised.
    pub(crate) fn into_source(self) -> Box<dyn std::error::Error + Send + Sync> {
        self.source
    }

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

/// How often a step has failed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Failures {
    rejected: usize,
    unsolved: usize,
    refused: bool,
}

/// After so many failures of a fresh start to solve the step it falls by larger factors: its scale
/// is not known.
const PATIENCE: usize = 2;

impl Failures {
    pub(crate) fn any(self) -> bool {
        self.rejected + self.unsolved > 0
    }

    /// Whether the problem itself refused an attempt that failed for this `reason`.
    pub(crate) fn is_refusal(reason: StopReason) -> bool {
        use StopReason::{ConvergenceFailures, ErrorTestFailures};
        !matches!(reason, ConvergenceFailures | ErrorTestFailures)
    }

    /// Whether the problem itself has refused a larger step: the accuracy does not require the size of
    /// this step.
    pub(crate) fn refused(self) -> bool {
        self.refused
    }

    /// Whether Newton's method has failed for a larger step, or the problem.
    pub(crate) fn unsolved(self) -> bool {
        self.unsolved > 0
    }

    /// No failures yet, after a step that the problem did or did not [refuse](Self::refused) to be longer.
    pub(crate) fn after(refused: bool) -> Self {
        Self {
            refused,
            ..Self::default()
        }
    }

    /// Counts again from zero.
    pub(crate) fn forget_counts(&mut self) {
        (self.rejected, self.unsolved) = (0, 0);
    }

    /// Counts one for this `reason`, here and in the statistics.
    pub(crate) fn count(&mut self, reason: StopReason, statistics: &mut Statistics) {
        if reason == StopReason::ErrorTestFailures {
            self.rejected += 1;
            statistics.error_test_failures += 1;
        } else {
            self.unsolved += 1;
            self.refused |= Self::is_refusal(reason);
            statistics.step_solve_failures += 1;
        }
    }

    /// Whether there are as many as the options allow.
    pub(crate) fn too_many(self, options: &RadauOptions) -> bool {
        self.rejected >= options.max_error_test_failures
            || self.unsolved >= options.max_convergence_failures
    }

    /// The factor on h for the next attempt, where the last one proposes `factor`.
    pub(crate) fn factor(self, factor: f64, fresh: bool) -> f64 {
        match fresh && self.unsolved > PATIENCE {
            true => factor.min(0.1),
            false => factor,
        }
    }
}

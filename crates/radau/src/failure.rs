//! Failures in a step and their consequences.

use myovib_dae::{Statistics, StepError, StopReason};

use crate::error::RadauError;
use crate::options::RadauOptions;

/// An operation that can fail: a function of the problem or an operation of its linear algebra.
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
    /// Converts an error of this operation; for use with `map_err`. After a recoverable error, the step size is halved.
    /// A fatal error ends the integration.
    pub(crate) fn failed(self) -> impl FnOnce(StepError) -> Failure {
        // The reason is reported if this operation fails for all step sizes.
        let (function, reason) = match self {
            Self::Residual => ("residual", StopReason::ResidualFailed),
            Self::Jacobian => ("Jacobian", StopReason::JacobianFailed),
            Self::LinearSetUp => ("linear setup", StopReason::LinearSetupFailed),
            Self::LinearSolve => ("linear solve", StopReason::LinearSolveFailed),
            Self::RootFunction => ("root function", StopReason::RootFunctionFailed),
            Self::ErrorWeights => ("error weight function", StopReason::ErrorWeightsFailed),
            Self::Quadrature => ("quadrature", StopReason::QuadratureFailed),
        };
        move |error| match error {
            StepError::Recoverable(message) => {
                Failure::Rejected(Rejection { reason, message, step_factor: 0.5 })
            }
            StepError::Fatal(source) => Failure::Fatal(Fatal { function, source }),
            other => Failure::Fatal(Fatal { function, source: other.into() }),
        }
    }
}

/// Reason why an attempt at a step failed.
#[derive(Debug)]
pub(crate) enum Failure {
    Rejected(Rejection),
    Fatal(Fatal),
}

/// Failure that may be avoided by a smaller step.
#[derive(Debug)]
pub(crate) struct Rejection {
    pub(crate) reason: StopReason,
    pub(crate) message: String,
    /// Factor for the step size of the next attempt.
    pub(crate) step_factor: f64,
}

/// Failure that a smaller step cannot avoid.
#[derive(Debug)]
pub(crate) struct Fatal {
    function: &'static str,
    source: Box<dyn std::error::Error + Send + Sync>,
}

impl Fatal {
    /// Returns the original error.
    pub(crate) fn into_source(self) -> Box<dyn std::error::Error + Send + Sync> {
        self.source
    }

    /// Returns the error of a step of size `h` from `t`.
    pub(crate) fn in_step(self, t: f64, h: f64) -> RadauError {
        let Self { function, source } = self;
        RadauError::Fatal { function, t, h, source }
    }
}

/// Counters of the failures in a step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Failures {
    rejected: usize,
    unsolved: usize,
    refused: bool,
    /// Whether the last step ended near a kink.
    near_kink: bool,
}

/// Number of failures to solve a step after which a first step, whose time scale is unknown, is reduced by a larger
/// factor, and another step is considered to be near a kink.
const PATIENCE: usize = 2;

impl Failures {
    pub(crate) fn any(self) -> bool {
        self.rejected + self.unsolved > 0
    }

    /// Returns whether an attempt that failed for this `reason` was rejected by the problem itself.
    pub(crate) fn is_refusal(reason: StopReason) -> bool {
        use StopReason::{ConvergenceFailures, ErrorTestFailures};
        !matches!(reason, ConvergenceFailures | ErrorTestFailures)
    }

    /// Returns whether the problem itself has rejected a larger step. If so, the size of this step is not determined by
    /// accuracy.
    pub(crate) fn refused(self) -> bool {
        self.refused
    }

    /// Returns whether Newton's method or the problem has failed for a larger step.
    pub(crate) fn unsolved(self) -> bool {
        self.unsolved > 0
    }

    /// Returns whether Newton's method has failed so often that F may have a kink near the start of the step. In this
    /// case, the next steps approach the kink until a step passes it.
    pub(crate) fn suggest_kink(self) -> bool {
        self.unsolved > PATIENCE || (self.near_kink && self.unsolved())
    }

    /// Returns zero counts for a new step. `refused` states whether the problem [rejected](Self::refused) a larger size
    /// of the previous step, and `near_kink` states whether the previous step [suggests a kink](Self::suggest_kink).
    pub(crate) fn after(refused: bool, near_kink: bool) -> Self {
        Self { refused, near_kink, ..Self::default() }
    }

    /// Resets the counts to zero.
    pub(crate) fn forget_counts(&mut self) {
        (self.rejected, self.unsolved) = (0, 0);
    }

    /// Counts a failure for the given `reason`, here and in the statistics.
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

    /// Returns whether the number of failures has reached a limit of the options.
    pub(crate) fn too_many(self, options: &RadauOptions) -> bool {
        self.rejected >= options.max_error_test_failures
            || self.unsolved >= options.max_convergence_failures
    }

    /// Returns the factor for the step size of the next attempt, given the `factor` proposed by the last attempt.
    pub(crate) fn factor(self, factor: f64, fresh: bool) -> f64 {
        match fresh && self.unsolved > PATIENCE {
            true => factor.min(0.1),
            false => factor,
        }
    }
}

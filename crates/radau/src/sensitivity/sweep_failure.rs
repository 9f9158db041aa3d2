//! Failures in the computation of sensitivities over a step.

use myovib_dae::StepError;

use super::krylov::Stalled;
use crate::failure::Failure;

/// Failures of the linear solves.
pub(super) enum SweepFailure {
    Stalled(Stalled),
    Failed(StepError),
}

impl SweepFailure {
    /// Returns the message of the failure, or the source of a fatal error.
    pub(super) fn message(self) -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
        match self {
            Self::Failed(StepError::Fatal(source)) => Err(source),
            Self::Failed(error) => Ok(error.to_string()),
            Self::Stalled(stalled) => Ok(stalled.to_string()),
        }
    }
}

impl From<Stalled> for SweepFailure {
    fn from(stalled: Stalled) -> Self {
        Self::Stalled(stalled)
    }
}

impl From<Failure> for SweepFailure {
    fn from(failure: Failure) -> Self {
        Self::Failed(match failure {
            Failure::Rejected(rejection) => StepError::Recoverable(rejection.message),
            Failure::Fatal(fatal) => StepError::Fatal(fatal.into_source()),
        })
    }
}

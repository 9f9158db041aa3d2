//! Failures in the computation of sensitivities over a step.

use myovib_dae::StepError;

use super::krylov::Stalled;
use crate::failure::Failure;

/// Failure of a linear solve or of a function.
#[derive(Debug, thiserror::Error)]
pub(super) enum SweepFailure {
    #[error(transparent)]
    Stalled(#[from] Stalled),
    /// Failure of a function, with the index of the parameter, or 0 if the failure concerns all parameters.
    #[error("{1}")]
    Failed(usize, StepError),
}

impl SweepFailure {
    /// Returns the message of the failure, or the source of a fatal error.
    pub(super) fn message(self) -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
        match self {
            Self::Failed(_, StepError::Fatal(source)) => Err(source),
            other => Ok(other.to_string()),
        }
    }

    /// Returns the index of the parameter.
    pub(super) fn parameter(&self) -> usize {
        match self {
            Self::Failed(j, _) => *j,
            Self::Stalled(stalled) => stalled.column,
        }
    }
}

impl From<StepError> for SweepFailure {
    fn from(error: StepError) -> Self {
        Self::Failed(0, error)
    }
}

impl From<(usize, StepError)> for SweepFailure {
    fn from((j, error): (usize, StepError)) -> Self {
        Self::Failed(j, error)
    }
}

impl From<(usize, Failure)> for SweepFailure {
    fn from((j, failure): (usize, Failure)) -> Self {
        let error = match failure {
            Failure::Rejected(rejection) => StepError::Recoverable(rejection.message),
            Failure::Fatal(fatal) => StepError::Fatal(fatal.into_source()),
        };
        Self::Failed(j, error)
    }
}

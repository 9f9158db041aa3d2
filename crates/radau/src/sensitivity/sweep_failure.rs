//! Failures of sensitivities over a step.

use myovib_dae::StepError;

use super::krylov::Stalled;
use crate::failure::Failure;

/// Failures of the linear solves.
pub(super) enum SweepFailure {
    Stalled(Stalled),
    Failed(StepError),
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

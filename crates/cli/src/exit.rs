//! Exit codes of the program, on which scripts rely.

use std::process::ExitCode;

use myovib_model::{EndReason, ModelError, Outcome};
use myovib_scene::Error;
use myovib_sparse::SparseError;

/// Result of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Success.
    Done = 0,
    /// A reproduction check failed, or `doctor` found a missing requirement.
    Differs = 1,
    /// Invalid usage, scene or mesh; nothing was written.
    Usage = 2,
    /// The integrator stopped before the end time; the output is kept.
    Stopped = 3,
    /// Failure at run time, for example because of a full disk, a missing file, insufficient memory, or an equilibrium
    /// that was not found. The output is kept.
    Failed = 4,
    /// Interrupted by Ctrl-C or by the system; the output is kept.
    Interrupted = 130,
}

impl Exit {
    /// Returns the exit code of a command that shows a run with this outcome. A stop at a requested event counts as
    /// success.
    pub fn of(outcome: &Outcome) -> Self {
        match outcome.reason() {
            None | Some(EndReason::Event) => Self::Done,
            Some(EndReason::Interrupted) => Self::Interrupted,
            Some(EndReason::NoEquilibrium | EndReason::Inverted) => Self::Failed,
            Some(_) => Self::Stopped,
        }
    }
}

impl Exit {
    /// Returns the exit code for a failed command. Most failures are caused by invalid input; some occur at run time.
    pub fn of_failure(failure: &anyhow::Error) -> Self {
        let at_work = |cause: &(dyn std::error::Error + 'static)| {
            let resources = |error: &SparseError| {
                matches!(error, SparseError::Memory { .. } | SparseError::Threads { .. })
            };
            if cause.downcast_ref::<SparseError>().is_some_and(resources) {
                return true;
            }
            let scene = cause.downcast_ref::<Error>();
            let model = cause.downcast_ref::<ModelError>();
            scene.is_some_and(|error| !matches!(error, Error::Input(_) | Error::Busy(_)))
                || matches!(
                    model,
                    Some(
                        ModelError::Output(_)
                            | ModelError::NoEquilibrium { .. }
                            | ModelError::Penetration { .. }
                            | ModelError::Factorization(
                                SparseError::Memory { .. } | SparseError::Threads { .. }
                            )
                    )
                )
        };
        if failure.chain().any(at_work) { Self::Failed } else { Self::Usage }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: for the same scene, `check` returned 2, but `run` returned 4.
    #[test]
    fn too_little_memory_is_not_an_input_error() {
        let memory = || SparseError::Memory { needed: 2, available: 1, n_complex: 0 };
        let of = |error: anyhow::Error| Exit::of_failure(&error);
        assert_eq!(of(memory().into()), Exit::Failed);
        assert_eq!(of(ModelError::from(memory()).into()), Exit::Failed);
        let threads = SparseError::Threads { threads: 2, reason: String::new() };
        assert_eq!(of(threads.into()), Exit::Failed);
        let at_start = Error::from(ModelError::from(memory())).before_any_output();
        assert_eq!(of(at_start.into()), Exit::Failed);
        let singular = ModelError::from(SparseError::ZeroPivot);
        assert_eq!(of(Error::from(singular).before_any_output().into()), Exit::Usage);
    }
}

//! The exit codes scripts rely on.

use std::process::ExitCode;

use myovib_model::{Outcome, StopReason};

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// A result differs from what was to be shown, or `doctor` found something missing.
    Differs = 1,
    /// Usage, scene or mesh is wrong; nothing was written.
    Usage = 2,
    /// The integrator stopped where it should not; the output is kept.
    Stopped = 3,
    /// Interrupted; the output is kept.
    Interrupted = 130,
}

impl Exit {
    /// How a command ends that shows a run as far as it got. With an event, which was asked for,
    /// the run is done.
    pub fn of(outcome: &Outcome) -> Self {
        match outcome.reason() {
            None | Some(StopReason::Event) => Self::Done,
            Some(StopReason::Interrupted) => Self::Interrupted,
            Some(_) => Self::Stopped,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}

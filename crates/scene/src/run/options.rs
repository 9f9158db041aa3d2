//! Options and result of a run.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use myovib_model::Outcome;

use crate::modes::Modes;
use crate::periodic::Periodic;
use crate::response::Response;
use crate::result_folder::Existing;
use crate::watch::{ProgressSink, Watcher};

/// Output folder, progress reports and other options of a run.
#[derive(Clone)]
pub struct RunOptions<'a> {
    /// Output folder.
    pub out: PathBuf,
    /// Policy for a run that already exists in the folder.
    pub existing: Existing,
    /// Flag that requests an orderly end of the run.
    pub interrupt: Option<&'static AtomicBool>,
    /// Receiver of progress reports.
    pub progress: &'a dyn ProgressSink,
    /// Folder of a similar scene whose equilibrium is the start of the search for an equilibrium.
    pub neighbor: Option<PathBuf>,
    /// Whether to estimate the error by a second run with looser tolerances.
    pub verify: bool,
}

impl RunOptions<'_> {
    /// Returns options for a run into an empty folder, without progress reports.
    pub fn into_folder(out: impl Into<PathBuf>) -> Self {
        Self {
            out: out.into(),
            existing: Existing::Refuse,
            interrupt: None,
            progress: &(),
            neighbor: None,
            verify: false,
        }
    }

    /// Returns the watcher of the run.
    pub(crate) fn watcher(&self) -> Watcher<'_> {
        Watcher { interrupt: self.interrupt, progress: self.progress }
    }
}

/// Result of a run.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// Body of `run.json`.
    pub document: serde_json::Value,
    /// Outcome of the run.
    pub outcome: Outcome,
    /// Notes on corrections made during the run.
    pub notes: Vec<String>,
    /// Result of a modal analysis.
    pub modes: Option<Modes>,
    /// Result of a harmonic response.
    pub response: Option<Response>,
    /// Periodic state.
    pub periodic: Option<Periodic>,
}

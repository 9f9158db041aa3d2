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
    pub out: PathBuf,
    /// Treatment of earlier results in the folder.
    pub existing: Existing,
    /// Flag that requests an orderly end of the run.
    pub interrupt: Option<&'static AtomicBool>,
    pub progress: &'a dyn ProgressSink,
    /// Folder of a similar scene. A search for an equilibrium starts from the equilibrium in this folder.
    pub neighbor: Option<PathBuf>,
    /// Whether to estimate the errors by a second run with looser tolerances.
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

    pub(crate) fn watcher(&self) -> Watcher<'_> {
        Watcher { interrupt: self.interrupt, progress: self.progress }
    }
}

#[derive(Debug, Clone)]
pub struct RunResult {
    /// Body of `run.json`.
    pub document: serde_json::Value,
    pub outcome: Outcome,
    /// Notes and warnings about the run and its results.
    pub notes: Vec<String>,
    pub modes: Option<Modes>,
    pub response: Option<Response>,
    pub periodic: Option<Periodic>,
}

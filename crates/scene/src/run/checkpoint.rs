//! Where a run can go on from.
//!
//! With Radau IIA the steps that follow are those of an uninterrupted run, bit by bit. IDAS cannot
//! restore its history of past steps, so a run with BDF starts anew from the state and its
//! derivative, at order 1.

use std::fs;

use myovib_model::{Continuation, Counts};
use serde::{Deserialize, Serialize};

use super::folder::Folder;
use super::indicator::Indicator;
use super::volume::Volumes;
use crate::csv::Written;
use crate::probe::EnergyBalance;
use crate::vtu::NotFinite;
use crate::{Error, InputError};

const NAME: &str = "checkpoint.json";

/// The state of a run, and what of its output was on the disk by then.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Checkpoint {
    /// Time, s.
    pub(super) t: f64,
    /// The unknowns.
    pub(super) y: Vec<f64>,
    /// Their derivatives.
    pub(super) y_dot: Vec<f64>,
    /// The last step, s.
    pub(super) step: f64,
    /// What else the steps that follow depend on, with Radau IIA.
    pub(super) continuation: Option<Continuation>,
    /// What each probe has written.
    pub(super) tables: Vec<Written>,
    /// Each energy probe.
    pub(super) energies: Vec<EnergyBalance>,
    /// Times of the fields written, s.
    pub(super) field_times: Vec<f64>,
    /// The largest constraint drift, and when.
    pub(super) drift: (f64, f64),
    /// Ratios of volumes at the vertices.
    #[serde(default)]
    pub(super) volumes: Volumes,
    /// Values of fields that are not finite.
    #[serde(default)]
    pub(super) not_finite: Option<NotFinite>,
    /// What the integrator's own estimates add up to at the probes.
    pub(super) indicator: Indicator,
    /// What was written or evaluated beside the integration.
    pub(super) work: OutputWork,
    /// The statistics of the starts before this one, which go on with a [`Continuation`] as those of
    /// one start.
    pub(super) counts: Totals,
}

/// Counts of what was written or evaluated beside the integration.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct OutputWork {
    pub(super) probe_rows: u64,
    pub(super) field_files: u64,
    pub(super) stress_evaluations: u64,
    pub(super) energy_evaluations: u64,
    pub(super) checkpoints: u64,
}

/// What adds up over the parts of a resumed run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Totals {
    #[serde(flatten)]
    pub(super) counts: Counts,
    /// How often the run went on from a checkpoint.
    pub(super) resumed: u64,
}

impl Totals {
    /// The sum with the counts of the present part.
    pub(super) fn plus(&self, counts: Counts) -> Self {
        Self {
            counts: self.counts.followed_by(counts),
            resumed: self.resumed,
        }
    }

    /// The same, gone on once more.
    pub(super) fn resumed(&self) -> Self {
        Self {
            resumed: self.resumed + 1,
            ..*self
        }
    }
}

impl Checkpoint {
    /// Writes it in place of the one before.
    pub(super) fn write(&self, folder: &Folder) -> Result<(), Error> {
        folder.write(NAME, &serde_json::to_string(self)?)
    }

    /// Reads the checkpoint in `folder`, whose run no event has ended, and which lies before `t_end`.
    pub(super) fn read(folder: &Folder, t_end: f64) -> Result<Self, InputError> {
        let path = folder.path().join(NAME);
        let text = fs::read_to_string(&path).map_err(|error| {
            InputError::new(format!("there is no checkpoint to go on from: {error}"))
                .at(path.display())
                .next("--overwrite computes the run from its start")
        })?;
        let checkpoint: Self = serde_json::from_str(&text).map_err(|error| {
            InputError::new(format!("this is no checkpoint of this version: {error}"))
                .at(path.display())
                .next("--overwrite computes the run from its start")
        })?;
        if let Some(t) = ended(folder) {
            return Err(InputError::new(
                "a [[stop]] ended the run: there is nothing to go on with",
            )
            .at(folder.path().display())
            .found(format!("t = {t} s"))
            .next("--overwrite computes it again, with another bound or none"));
        }
        if checkpoint.t >= t_end {
            let t = checkpoint.t;
            return Err(
                InputError::new("the run is finished: there is nothing to go on with")
                    .at(folder.path().display())
                    .found(format!("t = {t} s"))
                    .next("a later end goes on with it: --resume --set time.end=…")
                    .next("--overwrite computes it again"),
            );
        }
        Ok(checkpoint)
    }
}

/// When an event ended the run in the folder, s, if one did.
fn ended(folder: &Folder) -> Option<f64> {
    let text = fs::read_to_string(folder.path().join("run.json")).ok()?;
    let document: serde_json::Value = serde_json::from_str(&text).ok()?;
    let ended = document["reason"] == "event";
    ended.then(|| document["t_reached"].as_f64().unwrap_or_default())
}

//! Where a run can go on from.
//!
//! IDAS cannot restore its history of past steps, so a run that goes on starts anew from the
//! state and its derivative, at order 1.

use std::path::Path;

use anyhow::Context;
use myovib_model::Counts;
use serde::{Deserialize, Serialize};

use super::folder::Folder;
use crate::InputError;

const NAME: &str = "checkpoint.json";

/// The state of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Checkpoint {
    /// The scene, which must be the same to go on.
    pub(super) scene: serde_json::Value,
    /// Time, s.
    pub(super) t: f64,
    /// The unknowns.
    pub(super) y: Vec<f64>,
    /// Their derivatives.
    pub(super) y_dot: Vec<f64>,
    /// The last step, s.
    pub(super) step: f64,
    /// Work and dissipation of each energy probe, J/m.
    pub(super) energies: Vec<[f64; 2]>,
    /// Times of the fields written, s.
    pub(super) field_times: Vec<f64>,
    /// The statistics so far, over all parts of the run.
    pub(super) counts: Totals,
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
    pub(super) fn write(&self, folder: &Folder) -> anyhow::Result<()> {
        folder.write(NAME, &serde_json::to_string(self)?)
    }

    /// Reads the checkpoint in `folder`, which must be of this scene and before its end.
    pub(super) fn read(
        folder: &Path,
        scene: &serde_json::Value,
        t_end: f64,
    ) -> anyhow::Result<Self> {
        let path = folder.join(NAME);
        let text = std::fs::read_to_string(&path).map_err(|error| {
            InputError::new(format!("there is no checkpoint to go on from: {error}"))
                .at(path.display())
                .next("run without --resume")
        })?;
        let checkpoint: Self = serde_json::from_str(&text)
            .with_context(|| format!("{} is not a checkpoint of this version", path.display()))?;
        if checkpoint.scene != *scene {
            return Err(InputError::new("the checkpoint is of another scene")
                .at(path.display())
                .next("resume with the scene and the --set values of the first run")
                .into());
        }
        if checkpoint.t >= t_end {
            return Err(
                InputError::new("the run is finished: there is nothing to go on with")
                    .at(folder.display())
                    .found(format!("t = {} s", checkpoint.t))
                    .next("--overwrite computes it again")
                    .into(),
            );
        }
        Ok(checkpoint)
    }
}

//! State from which a run can continue.
//!
//! With Radau IIA, a resumed run takes exactly the same steps as an uninterrupted run, and its results are bitwise
//! identical. IDAS cannot restore its history of past steps. Therefore, a resumed BDF run restarts from the saved state
//! at order 1, with recomputed derivatives.

use std::path::Path;

use myovib_model::coupling::Driven;
use myovib_model::{Continuation, Counts, EndReason, WorkCounters};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::folder;
use super::indicator::Indicator;
use super::volume::Volumes;
use crate::csv::Written;
use crate::inputs::{self, sha256};
use crate::probe::{EnergyBalance, Reading};
use crate::result_folder::{self, ResultFolder};
use crate::state::State;
use crate::vtu::NotFinite;
use crate::{Error, InputError, Scene};

/// State of a run at a certain time, and the amount of output on the disk at this time.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Checkpoint {
    /// Time (s).
    pub(super) t: f64,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
    /// Last step size (s).
    pub(super) step: f64,
    /// Additional state of the integrator, for Radau IIA only.
    pub(super) continuation: Option<Continuation>,
    /// Amount of data that each probe has written.
    pub(super) tables: Vec<Written>,
    pub(super) energies: Vec<EnergyBalance>,
    /// Times (s) at which fields were written.
    pub(super) field_times: Vec<f64>,
    /// Largest constraint drift, and the time at which it occurred.
    pub(super) drift: (f64, f64),
    /// Volume ratios at the vertices.
    #[serde(default)]
    pub(super) volumes: Volumes,
    /// Non-finite values in the fields.
    #[serde(default)]
    pub(super) not_finite: Option<NotFinite>,
    /// Magnitudes of the displacements that drive separately integrated chains, and of the resulting positions.
    #[serde(default)]
    pub(super) driven: Option<Driven>,
    /// Error estimates of the integrator, accumulated for each probe.
    pub(super) indicator: Indicator,
    /// Counters of the work that only the outputs require.
    pub(super) work: OutputWork,
    pub(super) body_work: WorkCounters,
    /// Statistics of the earlier parts of the run that the [`Continuation`] does not contain.
    pub(super) counts: Totals,
}

/// Number of outputs, and number of evaluations that only the outputs require.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct OutputWork {
    pub(super) probe_rows: u64,
    pub(super) field_files: u64,
    pub(super) stress_evaluations: u64,
    pub(super) energy_evaluations: u64,
    pub(super) checkpoints: u64,
}

/// Totals over all parts of a resumed run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Totals {
    #[serde(flatten)]
    pub(super) counts: Counts,
    /// Counters of separately integrated chains.
    #[serde(default)]
    pub(super) chains: Counts,
    pub(super) resumed: u64,
}

impl Totals {
    /// Returns the sum of these totals and the counters of the current part of the run.
    pub(super) fn plus(&self, counts: Counts, chains: Option<Counts>) -> Self {
        Self {
            counts: self.counts.followed_by(counts),
            chains: chains.map_or(self.chains, |chains| self.chains.followed_by(chains)),
            resumed: self.resumed,
        }
    }

    /// Returns the totals with the number of resumes increased by one.
    pub(super) fn resumed(&self) -> Self {
        Self { resumed: self.resumed + 1, ..*self }
    }
}

impl Checkpoint {
    /// Writes the checkpoint, which replaces the previous one. A state with non-finite values is not written because no
    /// run could continue from it.
    pub(super) fn write(&self, folder: &ResultFolder, run: &Value) -> Result<(), Error> {
        if !self.is_finite() {
            return Ok(());
        }
        let body = serde_json::to_string(self)?;
        let head = serde_json::to_string(&Head::of(run, &body))?;
        let head = head.trim_end_matches('}');
        folder.write(folder::CHECKPOINT, format!("{head}{SEPARATOR}{body}}}\n"))
    }

    /// Reads the checkpoint in `folder`, which must belong to the run with the origin `run`. The whole file is checked
    /// before any part of it is used.
    pub(super) fn read(
        folder: &ResultFolder,
        scene: &Scene,
        readings: &[Box<dyn Reading>],
        run: &Value,
    ) -> Result<Self, InputError> {
        let path = folder.path().join(folder::CHECKPOINT);
        let wrong = |message: String| {
            InputError::new(message)
                .at(path.display())
                .next("--overwrite computes the run from the start")
        };
        let bytes = inputs::content(&path)
            .map_err(|error| wrong(format!("cannot read the checkpoint: {error}")))?;
        let checkpoint = Self::parse(&bytes, run)
            .and_then(|checkpoint| match checkpoint.mismatch(readings) {
                None => Ok(checkpoint),
                Some(what) => Err(Damage::Other(what)),
            })
            .map_err(|damage| wrong(damage.to_string()))?;
        if checkpoint.t > scene.t_end {
            return Err(finished(folder.path(), checkpoint.t));
        }
        Ok(checkpoint)
    }

    fn parse(bytes: &[u8], run: &Value) -> Result<Self, Damage> {
        let text = std::str::from_utf8(bytes).map_err(|_| Damage::NoCheckpoint)?;
        let (head, body) = text.split_once(SEPARATOR).ok_or(Damage::NoCheckpoint)?;
        let body = body.strip_suffix("}\n").ok_or(Damage::NoCheckpoint)?;
        let found: Head =
            serde_json::from_str(&format!("{head}}}")).map_err(|_| Damage::NoCheckpoint)?;
        let expected = Head::of(run, body);
        if (&found.schema, &found.version) != (&expected.schema, &expected.version) {
            return Err(Damage::Version(found.version));
        }
        if found.sha256 != expected.sha256 {
            return Err(Damage::Checksum);
        }
        if found.run != expected.run {
            return Err(Damage::Run);
        }
        let damage = |error: serde_json::Error| Damage::Other(error.to_string());
        let json: Value = serde_json::from_str(body).map_err(damage)?;
        match has_possible_counts(&json) {
            true => serde_json::from_value(json).map_err(damage),
            false => Err(Damage::Other(format!("a counter exceeds {LARGEST_COUNT}"))),
        }
    }

    fn is_finite(&self) -> bool {
        let times = [self.t, self.step, self.drift.0, self.drift.1];
        let all = times.iter().chain(&self.y).chain(&self.y_dot);
        all.chain(&self.field_times).all(|number| number.is_finite())
    }

    /// Returns the reason why the checkpoint does not match a run with the given probes, or `None` if it does.
    fn mismatch(&self, readings: &[Box<dyn Reading>]) -> Option<String> {
        let n_energies = readings.iter().filter(|what| what.balance().is_some()).count();
        let counts = [
            ("derivatives", self.y.len(), self.y_dot.len()),
            ("tables", readings.len(), self.tables.len()),
            ("energies", n_energies, self.energies.len()),
        ];
        let wrong = counts.into_iter().find(|(_, expected, found)| expected != found);
        if let Some((what, expected, found)) = wrong {
            return Some(format!("it has {found} {what} instead of {expected}"));
        }
        let is_in_order = self.field_times.windows(2).all(|pair| pair[0] < pair[1]);
        let is_possible = self.is_finite() && self.t >= 0.0 && self.step >= 0.0 && is_in_order;
        (!is_possible).then(|| "its counters are inconsistent".to_owned())
    }
}

/// Upper bound of counters, chosen so that the sum of a thousand counters does not overflow.
pub(super) const LARGEST_COUNT: u64 = 1 << 53;

/// Returns whether all integers are at most [`LARGEST_COUNT`].
fn has_possible_counts(json: &Value) -> bool {
    match json {
        Value::Number(number) => number.as_u64().is_none_or(|count| count <= LARGEST_COUNT),
        Value::Array(all) => all.iter().all(has_possible_counts),
        Value::Object(all) => all.values().all(has_possible_counts),
        _ => true,
    }
}

/// Separator between the head and the state.
const SEPARATOR: &str = ",\"checkpoint\":";

const SCHEMA: &str = "myovib/checkpoint/2";

/// Head of a checkpoint file.
#[derive(Serialize, Deserialize)]
struct Head {
    schema: String,
    version: String,
    /// Hash of the scene (without its end time) and its input files.
    run: String,
    /// Hash of the state.
    sha256: String,
}

impl Head {
    fn of(run: &Value, body: &str) -> Self {
        let run = folder::without_end(run).to_string();
        Self {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            run: sha256(run.as_bytes()),
            sha256: sha256(body.as_bytes()),
        }
    }
}

/// Reason why a file cannot be used as a checkpoint.
#[derive(Debug, PartialEq, thiserror::Error)]
enum Damage {
    #[error("the file is not a checkpoint")]
    NoCheckpoint,
    #[error("the checkpoint was written by version {0} of the program")]
    Version(String),
    #[error("the checkpoint was changed after it was written: its checksum differs")]
    Checksum,
    #[error("the checkpoint belongs to another scene, method or setting")]
    Run,
    #[error("the checkpoint cannot be used: {0}")]
    Other(String),
}

/// Returns the time at which the run in the folder ended, if the run is finished and all of its files exist.
fn completed(folder: &Path, scene: &Scene, verify: bool) -> Option<f64> {
    let read = |name: &str| {
        let bytes = inputs::content(&folder.join(name)).ok()?;
        serde_json::from_slice::<Value>(&bytes).ok()
    };
    let document = read(result_folder::DOCUMENT)?;
    let t = document["t_reached"].as_f64()?;
    let is_finished = document["outcome"] == "finished" && t >= scene.t_end;
    let is_verified = !verify || !document["error_estimate"].is_null();
    let has_state = scene.body.is_none() || read(State::NAME).is_some();
    let has_page = folder.join(result_folder::PAGE).is_file();
    let ended = is_finished && is_verified || document["reason"] == EndReason::Event.name();
    (ended && has_state && has_page).then_some(t)
}

/// Fails if the run in the folder is finished and all of its files exist, because there is nothing to continue.
pub(super) fn expect_incomplete(
    folder: &Path,
    scene: &Scene,
    verify: bool,
) -> Result<(), InputError> {
    completed(folder, scene, verify).map_or(Ok(()), |t| Err(finished(folder, t)))
}

/// Returns the error for an attempt to resume a run that ended at `t`.
fn finished(folder: &Path, t: f64) -> InputError {
    InputError::new("the run is finished: there is nothing to continue")
        .at(folder.display())
        .found(format!("t = {t} s"))
        .next("set a later end to continue it: --resume --set time.end=…")
        .next("--overwrite computes it again")
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::faults::SCENE;
    use super::super::{RunOptions, compute};
    use super::*;
    use crate::result_folder::FolderRequest;

    /// Regression: a state with NaN replaced the last checkpoint and could not be read.
    #[test]
    fn a_state_with_nan_does_not_replace_a_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let scene = Scene::build("scene.toml", SCENE, &[], Path::new("")).unwrap();
        compute(&scene, &RunOptions::into_folder(&out)).unwrap();
        let path = out.join(folder::CHECKPOINT);
        let mut json: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        let good: Checkpoint = serde_json::from_value(json["checkpoint"].take()).unwrap();
        let target = folder.path().join("target");
        let files = vec![folder::CHECKPOINT.to_owned()];
        let written = FolderRequest::to_add(&target, "run", files).open().unwrap();
        good.write(&written, &Value::Null).unwrap();
        let read = || fs::read(target.join(folder::CHECKPOINT)).unwrap();
        let before = read();
        let changes: [fn(&mut Checkpoint, f64); 4] = [
            |checkpoint, value| checkpoint.y[0] = value,
            |checkpoint, value| checkpoint.y_dot[0] = value,
            |checkpoint, value| checkpoint.step = value,
            |checkpoint, value| checkpoint.drift.0 = value,
        ];
        for change in changes {
            for value in [f64::NAN, f64::INFINITY] {
                let mut wrong = good.clone();
                change(&mut wrong, value);
                wrong.write(&written, &Value::Null).unwrap();
                assert!(read() == before, "{value}");
            }
        }
        // A finite state replaces the checkpoint.
        let other = Checkpoint { t: 0.5 * good.t, ..good };
        other.write(&written, &Value::Null).unwrap();
        assert!(read() != before);
    }
}

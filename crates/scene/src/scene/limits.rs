//! Limits on the output of a scene. They detect typing errors before a run takes hours or fills the disk.

use std::num::NonZeroUsize;

use super::builder::Builder;
use crate::InputError;
use crate::scene_file::output::Probe;
use crate::scene_file::{Analysis, SceneFile};
use crate::statistics::DRIFT_SAMPLES;

/// Maximum number of probes. Each probe keeps a file open, and systems allow about a thousand open files per process.
const MAX_PROBES: usize = 500;
/// Number of files that a run may have open in addition to the files of its probes: standard streams, the lock, and a
/// file in progress.
const OTHER_FILES: usize = 16;
/// Maximum number of rows of a probe. For a probe at a point, this corresponds to a file of about 1 GB.
const MAX_ROWS: f64 = 1e7;
/// Minimum number of rows per period of a load. With fewer rows, a curve may be misinterpreted, because a peak between
/// two rows may be more than 8 % higher than both.
const FEWEST_ROWS: f64 = 8.0;
/// Maximum number of field files and checkpoints. The smallest of these files have about 10 kB each.
const MAX_FILES: f64 = 1e5;

/// Returns the maximum number of open files of this process, if the system reports it.
#[cfg(unix)]
fn open_files() -> Option<usize> {
    use rustix::process::{Resource, getrlimit};
    usize::try_from(getrlimit(Resource::Nofile).current?).ok()
}

#[cfg(not(unix))]
fn open_files() -> Option<usize> {
    None
}

/// Returns a note on probes with too few rows per period of `drive`, the highest frequency (Hz) of the loads. Probes
/// that record only the start and the end (`t_end`, s) are excluded, because such probes are usually intended.
pub(super) fn coarse_probes(file: &SceneFile, t_end: f64, drive: Option<f64>) -> Option<String> {
    let drive = drive.filter(|_| file.analysis == Analysis::Dynamic)?;
    let is_coarse =
        |probe: &&Probe| probe.interval * drive > 1.0 / FEWEST_ROWS && probe.interval < t_end;
    let coarse: Vec<&Probe> = file.probe.iter().filter(is_coarse).collect();
    let names: Vec<String> = coarse.iter().map(|probe| format!("`{}`", probe.name)).collect();
    let interval = coarse.iter().map(|probe| probe.interval).reduce(f64::max)?;
    Some(format!(
        "the interval of {interval} s of probes {} does not resolve the load frequency of {drive} Hz: set \
         `interval` to 1/20 of the load period, {:.1e} s, or less",
        names.join(", "),
        0.05 / drive
    ))
}

/// Returns the maximum number of concurrent runs of a scene. It is limited because each run keeps the files of its
/// probes open.
pub(crate) fn runs_at_once(file: &SceneFile) -> NonZeroUsize {
    let runs = open_files().map(|files| files / (file.probe.len() + OTHER_FILES));
    runs.map_or(NonZeroUsize::MAX, |runs| NonZeroUsize::new(runs).unwrap_or(NonZeroUsize::MIN))
}

impl Builder<'_> {
    /// Rejects excessive output, and an end time that is too small to be divided into samples.
    pub(super) fn limits(&self) -> Result<(), InputError> {
        if self.file.time.is_some() && !(self.t_end / DRIFT_SAMPLES).is_normal() {
            let error = InputError::new("the end time is too small to be divided into samples")
                .found(format!("{:e} s", self.t_end))
                .allowed("a longer time in s");
            return Err(self.wrong("time.end", error));
        }
        if self.file.probe.len() > MAX_PROBES {
            let error = InputError::new("the scene has too many probes")
                .found(self.file.probe.len())
                .allowed(format!("at most {MAX_PROBES}: each keeps a file open"))
                .next("use lines of points, or write fields");
            return Err(self.wrong(&format!("probe[{MAX_PROBES}]"), error));
        }
        if let Some(files) = open_files() {
            let most = files.saturating_sub(OTHER_FILES);
            if self.file.probe.len() > most {
                let n = self.file.probe.len();
                let error =
                    InputError::new("each probe keeps a file open; the system allows fewer files")
                        .found(format!("{n} probes"))
                        .allowed(format!(
                            "{most}: a process may have {files} files open here, and needs some for other purposes"
                        ))
                        .next(format!(
                            "run `ulimit -n {}`, or use lines of points",
                            n + OTHER_FILES
                        ));
                return Err(self.wrong(&format!("probe[{most}]"), error));
            }
        }
        for (i, probe) in self.file.probe.iter().enumerate() {
            self.count(&format!("probe[{i}].interval"), probe.interval, MAX_ROWS, "rows")?;
        }
        if let Some(fields) = &self.file.fields {
            self.count("fields.interval", fields.interval, MAX_FILES, "files")?;
        }
        if let Some(checkpoint) = &self.file.checkpoint {
            self.count("checkpoint.interval", checkpoint.interval, MAX_FILES, "checkpoints")?;
        }
        Ok(())
    }

    fn count(&self, path: &str, every: f64, most: f64, what: &str) -> Result<(), InputError> {
        let count = self.t_end / every;
        if count <= most {
            return Ok(());
        }
        let error = InputError::new(format!("the run would have too many {what}"))
            .found(format!("{count:.0e}: every {every:e} s up to {:e} s", self.t_end))
            .allowed(format!("at most {most:.0e}"));
        Err(self.wrong(path, error))
    }
}

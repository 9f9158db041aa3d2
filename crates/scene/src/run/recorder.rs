//! Recorder that writes the values of a probe to a CSV file.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use myovib_model::{ModelError, SampleTimes};

use super::cut::cut;
use super::folder::table_of;
use crate::Error;
use crate::atomic_file::{self, Growing};
use crate::csv::{CsvWriter, Written};
use crate::probe::Reading;
use crate::result_folder::ResultFolder;
use crate::scene_file::output::Probe;

/// Probe, its file and its sample times.
pub(super) struct Recorder {
    pub(super) times: SampleTimes,
    pub(super) what: Box<dyn Reading>,
    path: PathBuf,
    csv: CsvWriter<Growing<File>>,
}

impl Recorder {
    pub(super) fn new(
        probe: &Probe,
        what: Box<dyn Reading>,
        t_end: f64,
        parameter: &str,
        folder: &ResultFolder,
    ) -> Result<Self, Error> {
        let name = table_of(&probe.name);
        let path = folder.path().join(&name);
        let csv = CsvWriter::new(folder.create(&name)?, &what.columns(parameter))
            .map_err(Error::file("write", &path))?;
        Ok(Self { times: SampleTimes::new(probe.interval, t_end), what, path, csv })
    }

    /// Continues the file of the probe after the rows that a checkpoint counts. Later rows are removed. Also returns a
    /// note if the removed rows were incomplete.
    pub(super) fn resumed(
        probe: &Probe,
        what: Box<dyn Reading>,
        t_end: f64,
        folder: &Path,
        written: &Written,
    ) -> Result<(Self, Option<String>), Error> {
        let path = folder.join(table_of(&probe.name));
        let (file, note) = cut(&path, written)?;
        let times = SampleTimes::new(probe.interval, t_end).skip(written.rows);
        let n_columns = what.names().len() + 1;
        let recorder = Self {
            times,
            what,
            path,
            csv: CsvWriter::continued(Growing(file), n_columns, written.clone()),
        };
        Ok((recorder, note))
    }

    pub(super) fn write(&mut self, t: f64, values: &[f64]) -> Result<(), ModelError> {
        let row: Vec<f64> = std::iter::once(t).chain(values.iter().copied()).collect();
        let written = self.csv.row(&row);
        written.map_err(|error| cannot_write(&self.path, error))
    }

    pub(super) fn written(&self) -> &Written {
        self.csv.written()
    }

    /// Waits until the rows are on the disk, and checks that the file still exists under its name.
    pub(super) fn sync(&self) -> Result<(), ModelError> {
        // A removed file still accepts rows while it is open, but these rows are lost.
        let checked = fs::symlink_metadata(&self.path).and_then(|there| {
            match there.len() == self.written().bytes {
                true => atomic_file::sync(&self.csv.sink().0),
                false => Err(io::Error::other("it was changed during the run")),
            }
        });
        checked.map_err(|error| cannot_write(&self.path, error))
    }
}

/// Returns the error of the operating system with the name of the file.
pub(super) fn cannot_write(path: &Path, error: io::Error) -> ModelError {
    let message = format!("cannot write `{}`: {error}", path.display());
    ModelError::Output(io::Error::new(error.kind(), message))
}

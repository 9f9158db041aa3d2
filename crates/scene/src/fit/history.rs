//! The file of a fit's iterations, from which a fit is resumed.

use std::fs::{self, File, OpenOptions};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use myovib_fit::{Iteration, Parameter};
use serde_json::Value;

use super::RESULTS;
use crate::csv::{CsvWriter, Table, Written};
use crate::{Error, InputError, atomic_file};

const HISTORY: &str = "history.csv";

/// File with the hashes of the scene and the measurements.
const ORIGIN: &str = "origin.json";

/// Columns before the parameters. `part` is the first part of the measurements' time that the cost is the sum over.
const COLUMNS: [&str; 4] = ["iteration", "runs", "part", "cost"];

/// Returns whether the folder holds a fit with at least one iteration.
pub(super) fn has_begun(folder: &Path) -> bool {
    text(folder).is_some_and(|text| text.lines().count() > 1)
}

/// Returns a file in the folder that a new fit would replace although no fit made it.
pub(super) fn foreign_file(folder: &Path) -> Option<PathBuf> {
    if text(folder).is_some_and(|text| text.starts_with(&COLUMNS.join(","))) {
        return None;
    }
    let names = RESULTS.into_iter().chain([HISTORY, ORIGIN]);
    let mut paths = names.map(|name| folder.join(name));
    paths.find(|path| path.symlink_metadata().is_ok())
}

fn text(folder: &Path) -> Option<String> {
    fs::read_to_string(folder.join(HISTORY)).ok()
}

/// The iterations in a file, each of which is on the disk before the next begins.
pub(super) struct History {
    /// Is opened at the first iteration.
    csv: Option<CsvWriter<File>>,
    columns: Vec<String>,
    folder: PathBuf,
    origin: Value,
    /// Iterations and runs of earlier fits in this file.
    before: [usize; 2],
    failed: Option<Error>,
}

fn columns(parameters: &[Parameter]) -> Vec<String> {
    let names = parameters.iter().map(|p| p.name.as_str());
    let all = COLUMNS.into_iter().chain(names);
    all.map(str::to_owned).collect()
}

/// Refuses to resume a fit of another scene or of other measurements: their costs cannot be compared.
fn expect_origin(folder: &Path, origin: &Value) -> Result<(), InputError> {
    let path = folder.join(ORIGIN);
    let known = fs::read_to_string(&path).ok();
    let known = known.and_then(|text| serde_json::from_str::<Value>(&text).ok());
    let Some(known) = known else {
        let error =
            InputError::new("the scene and the measurements of the earlier fit are unknown");
        let error = error.at(path.display()).found("no such file, or not JSON");
        return Err(error.next("use --overwrite to start again"));
    };
    let parts = origin.as_object().into_iter().flatten();
    let other = parts.filter(|(part, value)| known[part.as_str()] != **value);
    let other: Vec<&str> = other.map(|(part, _)| part.as_str()).collect();
    if other.is_empty() {
        return Ok(());
    }
    let error = InputError::new("the folder holds another fit").at(path.display());
    Err(error
        .found(format!("other {}", other.join(", ")))
        .next("repeat the arguments of that fit, or use --overwrite instead of --resume"))
}

impl History {
    /// Prepares a new file in `folder` for a fit with this `origin`. The folder, and an earlier fit in it, stay as they
    /// are until the first iteration.
    pub(super) fn begin(folder: &Path, parameters: &[Parameter], origin: Value) -> Self {
        Self {
            csv: None,
            columns: columns(parameters),
            folder: folder.to_owned(),
            origin,
            before: [0, 0],
            failed: None,
        }
    }

    /// Replaces an earlier fit by an empty history.
    fn open(&self) -> Result<CsvWriter<File>, Error> {
        let folder = &self.folder;
        fs::create_dir_all(folder).map_err(Error::file("make", folder))?;
        for name in RESULTS {
            let path = folder.join(name);
            match fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(Error::file("remove", &path)(error));
                }
                _ => {}
            }
        }
        atomic_file::save(&folder.join(ORIGIN), format!("{:#}\n", self.origin))?;
        let path = folder.join(HISTORY);
        let names: Vec<&str> = self.columns.iter().map(String::as_str).collect();
        File::create(&path)
            .and_then(|file| CsvWriter::new(file, &names))
            .map_err(Error::file("write", &path))
    }

    /// Continues the file in `folder`, which must have the same `origin`. The parameters start from the iteration with
    /// the smallest cost among those over most measurements.
    pub(super) fn resume(
        folder: &Path,
        parameters: &mut [Parameter],
        origin: Value,
    ) -> Result<Self, Error> {
        let path = folder.join(HISTORY);
        let wrong = |what: String| InputError::new(what).at(path.display());
        let text = fs::read_to_string(&path).map_err(|error| {
            wrong(format!(
                "cannot read the history of the earlier fit: {error}"
            ))
            .next("fit without --resume, or name the folder of that fit by --out")
        })?;
        expect_origin(folder, &origin)?;
        let table = Table::parse(&text).map_err(|error| wrong(format!("not a table: {error}")))?;
        let expected = columns(parameters);
        if table.names != expected {
            let error = wrong("the history has other parameters".to_owned());
            return Err(error
                .found(table.names.join(", "))
                .allowed(expected.join(", "))
                .into());
        }
        let number = |word: &String| word.parse::<f64>().ok().filter(|value| value.is_finite());
        let rows = table.rows.iter().map(|row| {
            let numbers: Option<Vec<f64>> = row.iter().map(number).collect();
            numbers
                .filter(|numbers| numbers.len() == expected.len())
                .ok_or_else(|| {
                    wrong("a row does not consist of finite numbers".to_owned())
                        .found(row.join(","))
                })
        });
        let rows: Vec<Vec<f64>> = rows.collect::<Result<_, _>>()?;
        let best = rows
            .iter()
            .min_by(|a, b| b[2].total_cmp(&a[2]).then(a[3].total_cmp(&b[3])));
        let (Some(best), Some(last)) = (best, rows.last()) else {
            let error = wrong("the history has no iteration".to_owned());
            return Err(error.next("fit without --resume").into());
        };
        for (parameter, &value) in parameters.iter_mut().zip(&best[4..]) {
            if !(parameter.low..=parameter.high).contains(&value) {
                let error = wrong(format!("{} is outside its bounds", parameter.name));
                let bounds = format!("{:e} to {:e}", parameter.low, parameter.high);
                return Err(error.found(format!("{value:e}")).allowed(bounds).into());
            }
            parameter.start = value;
        }
        let file = OpenOptions::new()
            .append(true)
            .open(&path)
            .map_err(Error::file("write", &path))?;
        let csv = CsvWriter::continued(file, expected.len(), Written::default());
        Ok(Self {
            csv: Some(csv),
            before: [last[0] as usize + 1, last[1] as usize],
            ..Self::begin(folder, parameters, origin)
        })
    }

    /// Adds iteration `number` of this fit, counted from 0. An error is reported by [`end`](Self::end).
    pub(super) fn add(&mut self, number: usize, part: f64, iteration: &Iteration) {
        if let Err(error) = self.write(number, part, iteration) {
            self.failed = Some(error);
        }
    }

    fn write(&mut self, number: usize, part: f64, iteration: &Iteration) -> Result<(), Error> {
        let mut csv = match self.csv.take() {
            Some(csv) => csv,
            None => self.open()?,
        };
        let [iterations, runs] = self.before;
        let counted = [iterations + number, runs + iteration.evaluations];
        let mut row = counted.map(|count| count as f64).to_vec();
        row.extend([part, iteration.cost]);
        row.extend(&iteration.values);
        let written = csv.row(&row).and_then(|()| csv.sink().sync_data());
        self.csv = Some(csv);
        written.map_err(Error::file("write", &self.folder.join(HISTORY)))
    }

    /// Reports whether all iterations were written.
    pub(super) fn end(self) -> Result<(), Error> {
        self.failed.map_or(Ok(()), Err)
    }
}

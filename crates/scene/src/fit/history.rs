//! The iterations of a fit in a file, to look at and to go on from.

use std::fs::{self, File, OpenOptions};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use myovib_fit::{Iteration, Parameter};
use serde_json::Value;

use super::RESULTS;
use crate::csv::{CsvWriter, Table, Written};
use crate::{Error, InputError, atomic_file};

const HISTORY: &str = "history.csv";

/// The file that says what is fitted to what.
const ORIGIN: &str = "origin.json";

/// What stands before the parameters in a row; the cost is that of this first part of the measurements' time.
const COLUMNS: [&str; 4] = ["iteration", "runs", "part", "cost"];

/// Whether the folder holds a fit that came to an iteration.
pub(super) fn has_begun(folder: &Path) -> bool {
    let text = fs::read_to_string(folder.join(HISTORY));
    text.is_ok_and(|text| text.lines().count() > 1)
}

/// The iterations in a file, each of which is on the disk when the next begins.
pub(super) struct History {
    csv: CsvWriter<File>,
    path: PathBuf,
    /// Iterations and runs before the next.
    before: [usize; 2],
    failed: Option<std::io::Error>,
}

fn columns(parameters: &[Parameter]) -> Vec<&str> {
    let names = parameters.iter().map(|p| p.name.as_str());
    COLUMNS.into_iter().chain(names).collect()
}

/// Refuses to go on with a fit of another scene or of other measurements: costs could not be compared.
fn expect_origin(folder: &Path, origin: &Value) -> Result<(), InputError> {
    let path = folder.join(ORIGIN);
    let known = fs::read_to_string(&path).ok();
    let known = known.and_then(|text| serde_json::from_str::<Value>(&text).ok());
    let Some(known) = known else {
        let error = InputError::new("it is not known what the history is of").at(path.display());
        let error = error.found("no such file, or another one");
        return Err(error.next("--overwrite fits anew"));
    };
    let parts = origin.as_object().into_iter().flatten();
    let other = parts.filter(|(part, value)| known[part.as_str()] != **value);
    let other: Vec<&str> = other.map(|(part, _)| part.as_str()).collect();
    if other.is_empty() {
        return Ok(());
    }
    let error = InputError::new("the history is of another fit").at(path.display());
    Err(error
        .found(format!("other {}", other.join(", ")))
        .next("give what that fit was given, or --overwrite in the place of --resume"))
}

impl History {
    /// A new file in `folder`, which is made, of a fit with this `origin`; results of an earlier one are removed.
    pub(super) fn begin(
        folder: &Path,
        parameters: &[Parameter],
        origin: &Value,
    ) -> Result<Self, Error> {
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
        atomic_file::save(&folder.join(ORIGIN), format!("{origin:#}\n"))?;
        let path = folder.join(HISTORY);
        let csv = File::create(&path)
            .and_then(|file| CsvWriter::new(file, &columns(parameters)))
            .map_err(Error::file("write", &path))?;
        Ok(Self {
            csv,
            path,
            before: [0, 0],
            failed: None,
        })
    }

    /// Goes on with the file in `folder`, which must have the same `origin`, and lets the parameters start where its
    /// cost of most measurements is least.
    pub(super) fn resume(
        folder: &Path,
        parameters: &mut [Parameter],
        origin: &Value,
    ) -> Result<Self, Error> {
        let path = folder.join(HISTORY);
        let wrong = |what: String| InputError::new(what).at(path.display());
        let text = fs::read_to_string(&path).map_err(|error| {
            wrong(format!("there is no history to go on from: {error}"))
                .next("fit without --resume, or name the folder of that fit by --out")
        })?;
        expect_origin(folder, origin)?;
        let table = Table::parse(&text).map_err(|error| wrong(format!("no table: {error}")))?;
        let expected = columns(parameters);
        if table.names != expected {
            let error = wrong("the history is of other parameters".to_owned());
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
                    wrong("a row is not one of finite numbers".to_owned()).found(row.join(","))
                })
        });
        let rows: Vec<Vec<f64>> = rows.collect::<Result<_, _>>()?;
        let n_columns = expected.len();
        let best = rows
            .iter()
            .min_by(|a, b| b[2].total_cmp(&a[2]).then(a[3].total_cmp(&b[3])));
        let (Some(best), Some(last)) = (best, rows.last()) else {
            let error = wrong("the history has no iteration to go on from".to_owned());
            return Err(error.next("fit without --resume").into());
        };
        for (parameter, &value) in parameters.iter_mut().zip(&best[4..]) {
            if !(parameter.low..=parameter.high).contains(&value) {
                let error = wrong(format!("{} lies outside of its bounds", parameter.name));
                let bounds = format!("{:e} to {:e}", parameter.low, parameter.high);
                return Err(error.found(format!("{value:e}")).allowed(bounds).into());
            }
            parameter.start = value;
        }
        let file = OpenOptions::new()
            .append(true)
            .open(&path)
            .map_err(Error::file("write", &path))?;
        Ok(Self {
            csv: CsvWriter::continued(file, n_columns, Written::default()),
            before: [last[0] as usize + 1, last[1] as usize],
            failed: None,
            path,
        })
    }

    /// Adds an iteration of this fit, in which they are counted from 0.
    pub(super) fn add(&mut self, number: usize, part: f64, iteration: &Iteration) {
        let [iterations, runs] = self.before;
        let counted = [iterations + number, runs + iteration.evaluations];
        let mut row = counted.map(|count| count as f64).to_vec();
        row.extend([part, iteration.cost]);
        row.extend(&iteration.values);
        let written = self
            .csv
            .row(&row)
            .and_then(|()| self.csv.sink().sync_data());
        if let Err(error) = written {
            self.failed = Some(error);
        }
    }

    /// Whether all was written.
    pub(super) fn end(self) -> Result<(), Error> {
        match self.failed {
            Some(error) => Err(Error::file("write", &self.path)(error)),
            None => Ok(()),
        }
    }
}

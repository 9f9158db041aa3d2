//! The file of a fit's iterations, from which a fit is resumed.

use std::fs::{self, File};

use myovib_fit::{Iteration, Parameter};

use crate::atomic_file::{self, Growing};
use crate::csv::{CsvWriter, Table, Written};
use crate::result_folder::{FolderRequest, ResultFolder};
use crate::{Error, InputError};

/// The file.
pub(super) const HISTORY: &str = "history.csv";

/// Columns before the parameters. `part` is the fraction of the measurement time, from its start, that contributes to
/// the cost.
const COLUMNS: [&str; 4] = ["iteration", "runs", "part", "cost"];

/// The iterations in a file. Each iteration is written to the disk before the next begins.
pub(super) struct History<'a> {
    /// Folder and table, which are opened at the first iteration.
    file: Option<(ResultFolder, CsvWriter<Growing<File>>)>,
    columns: Vec<String>,
    request: FolderRequest<'a>,
    /// Iterations and runs of earlier fits in this file.
    before: [usize; 2],
    failed: Option<Error>,
}

fn columns(parameters: &[Parameter]) -> Vec<String> {
    let names = parameters.iter().map(|p| p.name.as_str());
    let all = COLUMNS.into_iter().chain(names);
    all.map(str::to_owned).collect()
}

/// Refuses to resume a fit of another scene or to other measurements, because the costs could not be compared.
fn expect_origin(request: &FolderRequest<'_>) -> Result<(), InputError> {
    let Some(known) = request.earlier_origin()? else {
        return Ok(()); // the request reports that there is no fit
    };
    let parts = request.origin.as_object().into_iter().flatten();
    let other = parts.filter(|(part, value)| known[part.as_str()] != **value);
    let other: Vec<&str> = other.map(|(part, _)| part.as_str()).collect();
    if other.is_empty() {
        return Ok(());
    }
    let error = InputError::new("the folder contains another fit").at(request.path.display());
    Err(error
        .found(format!("other {}", other.join(", ")))
        .next("repeat the arguments of that fit, or use --overwrite instead of --resume"))
}

impl<'a> History<'a> {
    /// Prepares a new file. The folder and an earlier fit in it remain unchanged until the first iteration.
    pub(super) fn begin(request: FolderRequest<'a>, parameters: &[Parameter]) -> Self {
        Self {
            file: None,
            columns: columns(parameters),
            request,
            before: [0, 0],
            failed: None,
        }
    }

    /// Replaces an earlier fit by an empty history.
    fn open(&self) -> Result<(ResultFolder, CsvWriter<Growing<File>>), Error> {
        let folder = self.request.clone().open()?;
        let names: Vec<&str> = self.columns.iter().map(String::as_str).collect();
        let csv = CsvWriter::new(folder.create(HISTORY)?, &names)
            .map_err(Error::file("write", &folder.path().join(HISTORY)))?;
        Ok((folder, csv))
    }

    /// Continues the file of a fit with the same origin. The parameters start from the iteration with the smallest
    /// cost, among the iterations that used the most measurements.
    pub(super) fn resume(
        request: FolderRequest<'a>,
        parameters: &mut [Parameter],
    ) -> Result<Self, Error> {
        request.check()?;
        let path = request.path.join(HISTORY);
        let wrong = |what: String| InputError::new(what).at(path.display());
        let text = fs::read_to_string(&path).map_err(|error| {
            wrong(format!(
                "cannot read the history of the earlier fit: {error}"
            ))
            .next("fit without --resume, or name the folder of that fit by --out")
        })?;
        expect_origin(&request)?;
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
        let folder = request.clone().open()?;
        let file = atomic_file::append(&path).map_err(Error::file("write", &path))?;
        let csv = CsvWriter::continued(file, expected.len(), Written::default());
        Ok(Self {
            file: Some((folder, csv)),
            before: [last[0] as usize + 1, last[1] as usize],
            ..Self::begin(request, parameters)
        })
    }

    /// Adds iteration `number` of this fit, counted from 0. An error is reported by [`end`](Self::end).
    pub(super) fn add(&mut self, number: usize, part: f64, iteration: &Iteration) {
        if let Err(error) = self.write(number, part, iteration) {
            self.failed = Some(error);
        }
    }

    fn write(&mut self, number: usize, part: f64, iteration: &Iteration) -> Result<(), Error> {
        let (folder, mut csv) = match self.file.take() {
            Some(file) => file,
            None => self.open()?,
        };
        let [iterations, runs] = self.before;
        let counted = [iterations + number, runs + iteration.evaluations];
        let mut row = counted.map(|count| count as f64).to_vec();
        row.extend([part, iteration.cost]);
        row.extend(&iteration.values);
        let written = csv
            .row(&row)
            .and_then(|()| atomic_file::sync(&csv.sink().0));
        let path = folder.path().join(HISTORY);
        self.file = Some((folder, csv));
        written.map_err(Error::file("write", &path))
    }

    /// Reports whether all iterations were written. Also creates the folder of a fit that `succeeded` without any iteration.
    pub(super) fn end(self, succeeded: bool) -> Result<(), Error> {
        if succeeded && self.file.is_none() && self.failed.is_none() {
            self.open()?;
        }
        self.failed.map_or(Ok(()), Err)
    }
}

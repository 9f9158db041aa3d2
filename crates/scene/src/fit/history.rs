//! Files that grow during a fit: the table of iterations and the evaluations of the model.

use std::fs::File;

use myovib_fit::{Iteration, Parameter};

use super::evaluations::{EVALUATIONS, Evaluations};
use crate::Error;
use crate::atomic_file::{self, Growing};
use crate::csv::CsvWriter;
use crate::result_folder::{FolderRequest, ResultFolder};

/// Name of the file that contains the table of iterations.
pub(super) const HISTORY: &str = "history.csv";

/// Columns that precede the parameters. `part` is the fraction of the measured time span, counted from its start, that
/// the cost includes.
const COLUMNS: [&str; 4] = ["iteration", "runs", "part", "cost"];

/// Writer for the table of iterations. Each iteration is written to disk before the next one begins.
pub(super) struct History<'a> {
    files: Option<Files>,
    columns: Vec<String>,
    request: FolderRequest<'a>,
    evaluations: &'a Evaluations,
    failed: Option<Error>,
}

/// The locked folder and the table in it.
struct Files {
    folder: ResultFolder,
    table: CsvWriter<Growing<File>>,
}

impl<'a> History<'a> {
    /// Prepares the files. The folder and an earlier fit in it remain unchanged until the first iteration.
    pub(super) fn new(
        request: FolderRequest<'a>,
        parameters: &[Parameter],
        evaluations: &'a Evaluations,
    ) -> Self {
        let names = parameters.iter().map(|p| p.name.as_str());
        let columns = COLUMNS.into_iter().chain(names).map(str::to_owned);
        Self { files: None, columns: columns.collect(), request, evaluations, failed: None }
    }

    /// Opens the folder and replaces the table and the results of an earlier fit. The evaluations of a resumed fit are
    /// kept.
    fn open(&self) -> Result<Files, Error> {
        let folder = self.request.clone().open()?;
        self.evaluations.store_in(&folder)?;
        for name in &self.request.files {
            if name != EVALUATIONS {
                folder.remove(name)?;
            }
        }
        let table = CsvWriter::new(folder.create(HISTORY)?, &self.columns)
            .map_err(Error::file("write", &folder.path().join(HISTORY)))?;
        Ok(Files { folder, table })
    }

    /// Adds an iteration with the zero-based index `number`. Returns whether all files have been written without errors
    /// so far; [`end`](Self::end) returns the error.
    pub(super) fn add(&mut self, number: usize, part: f64, iteration: &Iteration) -> bool {
        let written = self.write(number, part, iteration);
        self.failed = self.failed.take().or(written.err());
        self.failed.is_none()
    }

    fn write(&mut self, number: usize, part: f64, iteration: &Iteration) -> Result<(), Error> {
        let mut files = match self.files.take() {
            Some(files) => files,
            None => self.open()?,
        };
        let mut row = [number, iteration.evaluations].map(|count| count as f64).to_vec();
        row.extend([part, iteration.cost]);
        row.extend(&iteration.values);
        let path = files.folder.path();
        let stored = self.evaluations.take_error(path).map_or(Ok(()), Err);
        let table = &mut files.table;
        let written = stored.and_then(|()| {
            let written = table.row(&row).and_then(|()| atomic_file::sync(&table.sink().0));
            written.map_err(Error::file("write", &path.join(HISTORY)))
        });
        self.files = Some(files);
        written
    }

    /// Returns an error if an iteration or an evaluation could not be written. If a fit `succeeded` without any
    /// iteration, also creates its folder.
    pub(super) fn end(&mut self, succeeded: bool) -> Result<(), Error> {
        if succeeded && self.files.is_none() && self.failed.is_none() {
            self.files = Some(self.open()?);
        }
        let files = self.files.as_ref();
        let of_evaluations = files.and_then(|own| self.evaluations.take_error(own.folder.path()));
        self.failed.take().or(of_evaluations).map_or(Ok(()), Err)
    }
}

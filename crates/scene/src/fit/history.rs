//! Files that grow during a fit: the table of iterations and the evaluations of the model.

use std::fs::File;
use std::io::Write;

use myovib_fit::{Iteration, Parameter};

use super::evaluations::{EVALUATIONS, Evaluations};
use crate::Error;
use crate::atomic_file::{self, Growing};
use crate::csv::CsvWriter;
use crate::result_folder::{FolderRequest, ResultFolder};

/// The table.
pub(super) const HISTORY: &str = "history.csv";

/// Columns before the parameters. `part` is the fraction of the measurement time, from its start, that contributes to
/// the cost.
const COLUMNS: [&str; 4] = ["iteration", "runs", "part", "cost"];

/// The iterations in a file. Each iteration is written to the disk before the next begins.
pub(super) struct History<'a> {
    files: Option<Files>,
    columns: Vec<String>,
    request: FolderRequest<'a>,
    evaluations: &'a Evaluations,
    failed: Option<Error>,
}

/// The folder and its growing files.
struct Files {
    folder: ResultFolder,
    table: CsvWriter<Growing<File>>,
    evaluations: Growing<File>,
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

    /// Replaces the table and the results of an earlier fit. Keeps the evaluations of a resumed fit.
    fn open(&self) -> Result<Files, Error> {
        let folder = self.request.clone().open()?;
        for name in &self.request.files {
            if name != EVALUATIONS {
                folder.remove(name)?;
            }
        }
        folder.write(EVALUATIONS, self.evaluations.lines())?;
        let path = folder.path().join(EVALUATIONS);
        let evaluations = atomic_file::append(&path).map_err(Error::file("write", &path))?;
        let names: Vec<&str> = self.columns.iter().map(String::as_str).collect();
        let table = CsvWriter::new(folder.create(HISTORY)?, &names)
            .map_err(Error::file("write", &folder.path().join(HISTORY)))?;
        Ok(Files { folder, table, evaluations })
    }

    /// Adds iteration `number`, counted from 0. An error is reported by [`end`](Self::end).
    pub(super) fn add(&mut self, number: usize, part: f64, iteration: &Iteration) {
        if let Err(error) = self.write(number, part, iteration) {
            self.failed = Some(error);
        }
    }

    fn write(&mut self, number: usize, part: f64, iteration: &Iteration) -> Result<(), Error> {
        let mut files = match self.files.take() {
            Some(files) => files,
            None => self.open()?,
        };
        let mut row = [number, iteration.evaluations].map(|count| count as f64).to_vec();
        row.extend([part, iteration.cost]);
        row.extend(&iteration.values);
        let new = self.evaluations.take_new();
        let evaluations = &mut files.evaluations;
        let kept = evaluations.write_all(new.as_bytes());
        let kept = kept.and_then(|()| atomic_file::sync(&evaluations.0));
        let table = &mut files.table;
        let written = table.row(&row);
        let written = written.and_then(|()| atomic_file::sync(&table.sink().0));
        let path = |name| files.folder.path().join(name);
        let ended = kept
            .map_err(Error::file("write", &path(EVALUATIONS)))
            .and(written.map_err(Error::file("write", &path(HISTORY))));
        self.files = Some(files);
        ended
    }

    /// Reports whether all iterations were written. Also creates the folder of a fit that `succeeded` without any iteration.
    pub(super) fn end(self, succeeded: bool) -> Result<(), Error> {
        if succeeded && self.files.is_none() && self.failed.is_none() {
            self.open()?;
        }
        self.failed.map_or(Ok(()), Err)
    }
}

//! Reads measurements from tables.
//!
//! The text is either a plain table or a long table in PEtab's format. A plain table has a column `t` or `time` (`f` or
//! `frequency` for frequencies, `load` for load factors), a column for each measured output, and optional columns
//! NAME.noise with standard deviations. A PEtab table has the columns `observableId`, `time` (or `frequency` or
//! `load`), `measurement` and, optionally, `noiseParameters`. An empty cell means that there is no measurement. Columns
//! are separated by commas, or by tabs if the header contains a tab.

mod error;

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::path::Path;

use crate::csv::Table;
use crate::inputs::content;
use crate::sensitivity::{Abscissa, Output};
use crate::text::utf8;
pub(super) use error::{DataError, DataProblem};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Datum {
    /// Time (s), frequency (Hz) or load factor.
    pub(super) t: f64,
    pub(super) output: usize,
    pub(super) value: f64,
    /// Standard deviation, if it is known.
    pub(super) noise: Option<f64>,
}

/// Independent variable of the measurements and its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Domain {
    pub(super) abscissa: Abscissa,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Domain {
    /// Returns the names that the column of this variable may have in a plain table. PEtab tables use the last of these
    /// names.
    fn names(self) -> &'static [&'static str] {
        match self.abscissa {
            Abscissa::Time => &["t", "time"],
            Abscissa::Frequency => &["f", "frequency"],
            Abscissa::Load => &["load"],
        }
    }
}

/// Maximum relative distance of a measurement from the domain that is attributed to rounding in other programs.
const ROUNDING: f64 = 1e-12;

/// Suffix of the names of columns that contain standard deviations in plain tables.
const NOISE: &str = ".noise";
/// Columns read from a PEtab measurement table.
const USED: [&str; 6] =
    ["observableId", "time", "frequency", "load", "measurement", "noiseParameters"];
/// PEtab columns that must contain a single value, because each file is one experiment.
const CONDITIONS: [&str; 3] = ["simulationConditionId", "experimentId", "modelId"];
/// PEtab columns that label measurements without changing their meaning.
const LABELS: [&str; 2] = ["datasetId", "replicateId"];
/// PEtab columns for which only one value is supported.
const NEUTRAL: [(&str, &str); 2] =
    [("observableTransformation", "lin"), ("noiseDistribution", "normal")];

/// Reads measurements of `outputs` within `domain`. Returns them in ascending order of time, frequency or load factor.
///
/// # Errors
/// Fails if `file` cannot be read (for example, because it is a device, a pipe or a folder), if its text is not UTF-8,
/// or if it is not a valid table. The error contains the line and the column where applicable.
pub(super) fn read_file(
    file: &Path,
    outputs: &[Output],
    domain: Domain,
) -> Result<Vec<Datum>, DataError> {
    let reader = Reader::new(file, outputs, domain);
    let bytes =
        content(file).map_err(|error| reader.error(DataProblem::Unreadable).found(error))?;
    let text = utf8(bytes).map_err(|line| reader.error(DataProblem::NotUtf8).at_line(line))?;
    reader.read(text.strip_prefix('\u{feff}').unwrap_or(&text))
}

struct Reader<'a> {
    file: String,
    outputs: &'a [Output],
    domain: Domain,
    table: Table,
}

impl<'a> Reader<'a> {
    fn new(file: &Path, outputs: &'a [Output], domain: Domain) -> Self {
        Self { file: file.display().to_string(), outputs, domain, table: Table::default() }
    }

    fn read(mut self, text: &str) -> Result<Vec<Datum>, DataError> {
        let table = Table::parse(text);
        self.table = table.map_err(|error| self.error(DataProblem::NotATable).found(error))?;
        let table = &self.table;
        if table.names.is_empty() {
            return Err(self.error(DataProblem::Empty));
        }
        for (k, name) in table.names.iter().enumerate() {
            if table.names[..k].contains(name) {
                return Err(self.error(DataProblem::DuplicateColumn).in_column(name));
            }
        }
        let is_long = table.names.iter().any(|name| name == "observableId");
        let mut data = match is_long {
            true => self.long()?,
            false => self.plain()?,
        };
        if data.is_empty() {
            return Err(self.error(DataProblem::Empty));
        }
        let known = data.iter().filter(|datum| datum.noise.is_some()).count();
        if known != 0 && known != data.len() {
            return Err(self.error(DataProblem::PartialNoise));
        }
        data.sort_by(|a, b| a.t.total_cmp(&b.t));
        Ok(data)
    }

    fn error(&self, problem: DataProblem) -> DataError {
        DataError::new(problem, &self.file)
    }

    /// Returns an error located at a cell, or at a row if no column is given.
    fn error_at(&self, problem: DataProblem, row: usize, column: Option<usize>) -> DataError {
        let error = self.error(problem).at_line(self.table.lines[row]);
        match column.and_then(|column| self.table.names.get(column)) {
            Some(name) => error.in_column(name),
            None => error,
        }
    }

    fn column(&self, names: &[&str]) -> Result<usize, DataError> {
        let found = self.table.names.iter().position(|name| names.contains(&name.as_str()));
        found.ok_or_else(|| {
            self.error(DataProblem::MissingColumn)
                .in_column(&names.join(" or "))
                .found(self.table.names.join(", "))
        })
    }

    fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|output| output.name == name)
    }

    fn unknown_output(&self, error: DataError, name: &str) -> DataError {
        let names: Vec<&str> = self.outputs.iter().map(|o| o.name.as_str()).collect();
        error.found(format!("`{name}`")).allowed(names.join(", "))
    }

    /// Rejects a row shorter or longer than the header. An empty cell means that there is no measurement,
    /// whereas a missing cell means that the file is damaged.
    fn expect_whole(&self, row: usize) -> Result<(), DataError> {
        let (found, wanted) = (self.table.rows[row].len(), self.table.names.len());
        let problem = match found.cmp(&wanted) {
            Ordering::Equal => return Ok(()),
            Ordering::Less => DataProblem::ShortRow,
            Ordering::Greater => DataProblem::LongRow,
        };
        let error = self.error_at(problem, row, None);
        Err(error.found(format!("{found} cells")).allowed(wanted))
    }

    /// Rejects columns that would change the meaning of the measurements if they were ignored. Empty columns are
    /// accepted.
    fn expect_supported_columns(&self) -> Result<(), DataError> {
        for (column, name) in self.table.names.iter().enumerate() {
            let name = name.as_str();
            if USED.contains(&name) || LABELS.contains(&name) {
                continue;
            }
            let neutral = NEUTRAL.iter().find(|(known, _)| *known == name);
            let entries = (0..self.table.rows.len()).filter_map(|row| {
                let entry = self.table.rows[row].get(column)?.as_str();
                let counts = !entry.is_empty() && neutral.is_none_or(|(_, value)| *value != entry);
                counts.then_some((row, entry))
            });
            if CONDITIONS.contains(&name) {
                let values: BTreeSet<&str> = entries.map(|(_, entry)| entry).collect();
                if values.len() > 1 {
                    let values: Vec<&str> = values.into_iter().collect();
                    let error = self.error(DataProblem::SeveralConditions).in_column(name);
                    return Err(error.found(values.join(", ")));
                }
            } else if let Some((row, entry)) = { entries }.next() {
                let error = self.error_at(DataProblem::UnsupportedColumn, row, Some(column));
                let error = error.found(format!("`{entry}`"));
                return Err(match neutral {
                    Some((_, value)) => error.allowed(value),
                    None => error.allowed([&USED[..], &CONDITIONS, &LABELS].concat().join(", ")),
                });
            }
        }
        Ok(())
    }

    /// Returns the number in a cell, or `None` if the cell is empty.
    fn number(&self, row: usize, column: usize) -> Result<Option<f64>, DataError> {
        let word = self.table.rows[row].get(column).map_or("", String::as_str);
        if word.is_empty() {
            return Ok(None);
        }
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => {
                let error = self.error_at(DataProblem::NotANumber, row, Some(column));
                Err(error.found(format!("`{word}`")))
            }
        }
    }

    fn time(&self, row: usize, column: usize) -> Result<f64, DataError> {
        let error = |problem| self.error_at(problem, row, Some(column));
        let t = self.number(row, column)?.ok_or_else(|| error(DataProblem::MissingTime))?;
        let Domain { abscissa, low, high } = self.domain;
        let nearest = t.clamp(low, high);
        if (t - nearest).abs() <= ROUNDING * nearest.abs() {
            return Ok(nearest);
        }
        let (problem, unit, range) = match abscissa {
            Abscissa::Time => (DataProblem::OutsideRun, " s", "the scene's time.end"),
            Abscissa::Frequency => (
                DataProblem::OutsideFrequencies,
                " Hz",
                "the range of the scene's response.frequencies",
            ),
            Abscissa::Load => {
                (DataProblem::OutsideLoads, "", "the range of the scene's load factors")
            }
        };
        Err(error(problem)
            .found(format!("{} = {t}{unit}", abscissa.name()))
            .allowed(format!("{low} to {high}{unit}, {range}")))
    }

    /// Returns the measurement of `output` in a cell, or `None` if the cell is empty.
    fn measurement(
        &self,
        row: usize,
        column: usize,
        output: usize,
    ) -> Result<Option<f64>, DataError> {
        let value = self.number(row, column)?;
        let wave = self.outputs[output].shear_wave;
        match (value, wave) {
            (Some(value), Some(wave)) if !wave.accepts(value) => {
                let error = self.error_at(DataProblem::NotAWave, row, Some(column));
                Err(error.found(value))
            }
            _ => Ok(value),
        }
    }

    fn noise(
        &self,
        row: usize,
        column: Option<usize>,
        output: usize,
    ) -> Result<Option<f64>, DataError> {
        let own = match column {
            Some(column) => self.number(row, column)?,
            None => None,
        };
        match own {
            Some(noise) if noise <= 0.0 => {
                let error = self.error_at(DataProblem::NonpositiveNoise, row, column);
                Err(error.found(noise))
            }
            own => Ok(own.or(self.outputs[output].noise)),
        }
    }

    fn long(&self) -> Result<Vec<Datum>, DataError> {
        let id = self.column(&["observableId"])?;
        let names = self.domain.names();
        let time = self.column(&names[names.len() - 1..])?;
        let measurement = self.column(&["measurement"])?;
        let noise = self.table.names.iter().position(|name| name == "noiseParameters");
        self.expect_supported_columns()?;
        let mut data = Vec::new();
        for row in 0..self.table.rows.len() {
            self.expect_whole(row)?;
            let name = self.table.rows[row].get(id).map_or("", String::as_str);
            let output = self.output(name).ok_or_else(|| {
                let error = self.error_at(DataProblem::UnknownOutput, row, Some(id));
                self.unknown_output(error, name)
            })?;
            let t = self.time(row, time)?;
            if let Some(value) = self.measurement(row, measurement, output)? {
                let noise = self.noise(row, noise, output)?;
                data.push(Datum { t, output, value, noise });
            }
        }
        Ok(data)
    }

    fn plain(&self) -> Result<Vec<Datum>, DataError> {
        let time = self.column(self.domain.names())?;
        let mut columns = Vec::new();
        for (column, name) in self.table.names.iter().enumerate() {
            if column == time {
                continue;
            }
            if let Some(output) = self.output(name) {
                let noise = format!("{name}{NOISE}");
                let noise = self.table.names.iter().position(|name| *name == noise);
                columns.push((column, output, noise));
                continue;
            }
            let measured = name.strip_suffix(NOISE).filter(|measured| {
                self.output(measured).is_some()
                    && self.table.names.iter().any(|name| name == measured)
            });
            if measured.is_none() {
                let error = self.error(DataProblem::UnknownOutput).in_column(name);
                return Err(self.unknown_output(error, name));
            }
        }
        let mut data = Vec::new();
        for row in 0..self.table.rows.len() {
            self.expect_whole(row)?;
            let t = self.time(row, time)?;
            for &(column, output, noise) in &columns {
                if let Some(value) = self.measurement(row, column, output)? {
                    let noise = self.noise(row, noise, output)?;
                    data.push(Datum { t, output, value, noise });
                }
            }
        }
        Ok(data)
    }
}

#[cfg(test)]
mod tests;

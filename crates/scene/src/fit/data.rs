//! Reads measurements from tables.

mod error;

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::path::Path;

use crate::csv::Table;
use crate::inputs::content;
use crate::sensitivity::Output;
use crate::text::utf8;
pub use error::{DataError, DataProblem};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datum {
    /// Time (s), frequency (Hz) or load factor.
    pub t: f64,
    pub output: usize,
    pub value: f64,
    /// Standard deviation, if it is known.
    pub noise: Option<f64>,
}

/// Independent variable of the measurements and its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// Time from 0 to `end` (s).
    Time { end: f64 },
    /// Frequency (Hz).
    Frequency { low: f64, high: f64 },
    /// Load factor of a static analysis.
    Load { low: f64, high: f64 },
}

impl Domain {
    /// Returns the names that the column of this variable may have in a plain table. PEtab tables use the last of these
    /// names.
    fn names(self) -> &'static [&'static str] {
        match self {
            Self::Time { .. } => &["t", "time"],
            Self::Frequency { .. } => &["f", "frequency"],
            Self::Load { .. } => &["load"],
        }
    }

    fn limits(self) -> (f64, f64) {
        match self {
            Self::Time { end } => (0.0, end),
            Self::Frequency { low, high } | Self::Load { low, high } => (low, high),
        }
    }
}

/// Maximum relative distance outside the domain that is attributed to rounding in other programs.
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

/// Reads the measurements in `file`; see [`read`].
///
/// # Errors
/// Fails if `file` cannot be read (for example, because it is a device, a pipe or a folder), if its text is not UTF-8,
/// or if [`read`] fails.
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

/// Reads measurements of `outputs` within `domain`. Returns them in ascending order of time, frequency or load factor.
///
/// The text is either a plain table or a long table in PEtab's format. A plain table has a column `t` or `time` (`f` or
/// `frequency` for frequencies, `load` for load factors), a column for each measured output, and optional columns
/// NAME.noise with standard deviations. A PEtab table has the columns `observableId`, `time` (or `frequency` or
/// `load`), `measurement` and, optionally, `noiseParameters`. An empty cell means that there is no measurement. Columns
/// are separated by commas, or by tabs if the header contains a tab.
///
/// # Errors
/// Returns a [`DataError`], with the line and the column where applicable.
pub fn read(
    name: &Path,
    text: &str,
    outputs: &[Output],
    domain: Domain,
) -> Result<Vec<Datum>, DataError> {
    Reader::new(name, outputs, domain).read(text)
}

struct Reader<'a> {
    file: String,
    outputs: &'a [Output],
    domain: Domain,
}

impl<'a> Reader<'a> {
    fn new(file: &Path, outputs: &'a [Output], domain: Domain) -> Self {
        Self { file: file.display().to_string(), outputs, domain }
    }

    fn read(&self, text: &str) -> Result<Vec<Datum>, DataError> {
        let table =
            Table::parse(text).map_err(|error| self.error(DataProblem::NotATable).found(error))?;
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
            true => self.long(&table)?,
            false => self.plain(&table)?,
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
    fn error_at(
        &self,
        problem: DataProblem,
        table: &Table,
        row: usize,
        column: Option<usize>,
    ) -> DataError {
        let error = self.error(problem).at_line(table.lines[row]);
        match column.and_then(|column| table.names.get(column)) {
            Some(name) => error.in_column(name),
            None => error,
        }
    }

    fn column(&self, table: &Table, names: &[&str]) -> Result<usize, DataError> {
        let found = table.names.iter().position(|name| names.contains(&name.as_str()));
        found.ok_or_else(|| {
            self.error(DataProblem::MissingColumn)
                .in_column(&names.join(" or "))
                .found(table.names.join(", "))
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
    fn expect_whole(&self, table: &Table, row: usize) -> Result<(), DataError> {
        let (found, wanted) = (table.rows[row].len(), table.names.len());
        let problem = match found.cmp(&wanted) {
            Ordering::Equal => return Ok(()),
            Ordering::Less => DataProblem::ShortRow,
            Ordering::Greater => DataProblem::LongRow,
        };
        let error = self.error_at(problem, table, row, None);
        Err(error.found(format!("{found} cells")).allowed(wanted))
    }

    /// Rejects columns that would change the meaning of the measurements if they were ignored. Empty columns are
    /// accepted.
    fn expect_supported_columns(&self, table: &Table) -> Result<(), DataError> {
        for (column, name) in table.names.iter().enumerate() {
            let name = name.as_str();
            if USED.contains(&name) || LABELS.contains(&name) {
                continue;
            }
            let neutral = NEUTRAL.iter().find(|(known, _)| *known == name);
            let entries = (0..table.rows.len()).filter_map(|row| {
                let entry = table.rows[row].get(column)?.as_str();
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
                let error = self.error_at(DataProblem::UnsupportedColumn, table, row, Some(column));
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
    fn number(&self, table: &Table, row: usize, column: usize) -> Result<Option<f64>, DataError> {
        let word = table.rows[row].get(column).map_or("", String::as_str);
        if word.is_empty() {
            return Ok(None);
        }
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => {
                let error = self.error_at(DataProblem::NotANumber, table, row, Some(column));
                Err(error.found(format!("`{word}`")))
            }
        }
    }

    fn time(&self, table: &Table, row: usize, column: usize) -> Result<f64, DataError> {
        let error = |problem| self.error_at(problem, table, row, Some(column));
        let t = self.number(table, row, column)?.ok_or_else(|| error(DataProblem::MissingTime))?;
        let (low, high) = self.domain.limits();
        let nearest = t.clamp(low, high);
        if (t - nearest).abs() <= ROUNDING * nearest.abs() {
            return Ok(nearest);
        }
        Err(match self.domain {
            Domain::Time { end } => error(DataProblem::OutsideRun)
                .found(format!("t = {t} s"))
                .allowed(format!("0 to {end} s, the scene's time.end")),
            Domain::Frequency { .. } => {
                error(DataProblem::OutsideFrequencies).found(format!("f = {t} Hz")).allowed(
                    format!("{low} to {high} Hz, the range of the scene's response.frequencies"),
                )
            }
            Domain::Load { .. } => error(DataProblem::OutsideLoads)
                .found(format!("load = {t}"))
                .allowed(format!("{low} to {high}, the range of the scene's load factors")),
        })
    }

    /// Returns the measurement of `output` in a cell, or `None` if the cell is empty.
    fn measurement(
        &self,
        table: &Table,
        row: usize,
        column: usize,
        output: usize,
    ) -> Result<Option<f64>, DataError> {
        let value = self.number(table, row, column)?;
        let wave = self.outputs[output].shear_wave;
        match (value, wave) {
            (Some(value), Some(wave)) if !wave.accepts(value) => {
                let error = self.error_at(DataProblem::NotAWave, table, row, Some(column));
                Err(error.found(value))
            }
            _ => Ok(value),
        }
    }

    fn noise(
        &self,
        table: &Table,
        row: usize,
        column: Option<usize>,
        output: usize,
    ) -> Result<Option<f64>, DataError> {
        let own = match column {
            Some(column) => self.number(table, row, column)?,
            None => None,
        };
        match own {
            Some(noise) if noise <= 0.0 => {
                let error = self.error_at(DataProblem::NonpositiveNoise, table, row, column);
                Err(error.found(noise))
            }
            own => Ok(own.or(self.outputs[output].noise)),
        }
    }

    fn long(&self, table: &Table) -> Result<Vec<Datum>, DataError> {
        let id = self.column(table, &["observableId"])?;
        let names = self.domain.names();
        let time = self.column(table, &names[names.len() - 1..])?;
        let measurement = self.column(table, &["measurement"])?;
        let noise = table.names.iter().position(|name| name == "noiseParameters");
        self.expect_supported_columns(table)?;
        let mut data = Vec::new();
        for row in 0..table.rows.len() {
            self.expect_whole(table, row)?;
            let name = table.rows[row].get(id).map_or("", String::as_str);
            let output = self.output(name).ok_or_else(|| {
                let error = self.error_at(DataProblem::UnknownOutput, table, row, Some(id));
                self.unknown_output(error, name)
            })?;
            let t = self.time(table, row, time)?;
            if let Some(value) = self.measurement(table, row, measurement, output)? {
                let noise = self.noise(table, row, noise, output)?;
                data.push(Datum { t, output, value, noise });
            }
        }
        Ok(data)
    }

    fn plain(&self, table: &Table) -> Result<Vec<Datum>, DataError> {
        let time = self.column(table, self.domain.names())?;
        let mut columns = Vec::new();
        for (column, name) in table.names.iter().enumerate() {
            if column == time {
                continue;
            }
            if let Some(output) = self.output(name) {
                let noise = format!("{name}{NOISE}");
                let noise = table.names.iter().position(|name| *name == noise);
                columns.push((column, output, noise));
                continue;
            }
            let measured = name.strip_suffix(NOISE).filter(|measured| {
                self.output(measured).is_some() && table.names.iter().any(|name| name == measured)
            });
            if measured.is_none() {
                let error = self.error(DataProblem::UnknownOutput).in_column(name);
                return Err(self.unknown_output(error, name));
            }
        }
        let mut data = Vec::new();
        for row in 0..table.rows.len() {
            self.expect_whole(table, row)?;
            let t = self.time(table, row, time)?;
            for &(column, output, noise) in &columns {
                if let Some(value) = self.measurement(table, row, column, output)? {
                    let noise = self.noise(table, row, noise, output)?;
                    data.push(Datum { t, output, value, noise });
                }
            }
        }
        Ok(data)
    }
}

#[cfg(test)]
mod tests;

//! Reads measurements from tables.

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::fmt;
use std::path::Path;

use crate::InputError;
use crate::csv::Table;
use crate::inputs::content;
use crate::sensitivity::Output;

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datum {
    /// Time, s.
    pub t: f64,
    /// Number of the output.
    pub output: usize,
    /// Measured value.
    pub value: f64,
    /// Standard deviation, if it is known.
    pub noise: Option<f64>,
}

/// Names of the time column in plain tables.
const TIME: [&str; 2] = ["t", "time"];
/// Suffix of columns of standard deviations in plain tables.
const NOISE: &str = ".noise";
/// Required and optional columns of PEtab's measurement table.
const USED: [&str; 4] = ["observableId", "time", "measurement", "noiseParameters"];
/// Columns of PEtab that must have a single value, as a file is one experiment.
const CONDITIONS: [&str; 3] = ["simulationConditionId", "experimentId", "modelId"];
/// Columns of PEtab that label measurements without changing their meaning.
const LABELS: [&str; 2] = ["datasetId", "replicateId"];
/// Columns of PEtab with the only supported value.
const NEUTRAL: [(&str, &str); 2] = [
    ("observableTransformation", "lin"),
    ("noiseDistribution", "normal"),
];

/// Reason why measurements are rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataProblem {
    /// The file cannot be read, or is not a regular file.
    Unreadable,
    /// The text is not UTF-8.
    NotUtf8,
    /// The text is not a table of separated values.
    NotATable,
    /// The file has no measurement.
    Empty,
    /// A required column is missing.
    MissingColumn,
    /// Two columns have the same name.
    DuplicateColumn,
    /// A column would change the meaning of the measurements.
    UnsupportedColumn,
    /// A file has measurements under several conditions.
    SeveralConditions,
    /// An output that the scene does not have.
    UnknownOutput,
    /// A row with fewer cells than the header.
    ShortRow,
    /// A row with more cells than the header.
    LongRow,
    /// A cell without a finite number.
    NotANumber,
    /// A measurement without a time.
    MissingTime,
    /// A time before 0 or after the end of the run.
    OutsideRun,
    /// A standard deviation of zero or less.
    NonpositiveNoise,
    /// Some measurements have a standard deviation, others do not.
    PartialNoise,
}

impl fmt::Display for DataProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unreadable => "cannot read the measurements",
            Self::NotUtf8 => "the measurements are not UTF-8 text",
            Self::NotATable => "the measurements are not a table",
            Self::Empty => "the file has no measurement",
            Self::MissingColumn => "a column is missing",
            Self::DuplicateColumn => "duplicate column name",
            Self::UnsupportedColumn => {
                "this column changes the meaning of the measurements and is not supported"
            }
            Self::SeveralConditions => "the file has measurements under several conditions",
            Self::UnknownOutput => "the scene has no such output",
            Self::ShortRow => "the row has fewer cells than the header",
            Self::LongRow => "the row has more cells than the header",
            Self::NotANumber => {
                "times, measurements and standard deviations must be finite numbers"
            }
            Self::MissingTime => "a measurement needs a time",
            Self::OutsideRun => "the time is outside the run",
            Self::NonpositiveNoise => "a standard deviation must be positive",
            Self::PartialNoise => "some measurements have a standard deviation, others do not",
        })
    }
}

impl DataProblem {
    /// Returns the remedy, or an empty text.
    fn remedy(self) -> &'static str {
        match self {
            Self::NotUtf8 => "save the file with the encoding UTF-8",
            Self::UnsupportedColumn => {
                "convert the measurements to the output's unit and meaning, then remove the column"
            }
            Self::SeveralConditions => {
                "write one file per condition, and give each its own --data with KEY=VALUE after the file name"
            }
            Self::UnknownOutput => "name it in an [[output]] with its probe and column",
            Self::ShortRow => "leave a cell empty where nothing was measured",
            Self::LongRow => {
                "use decimal points, not commas, and write nothing after the last cell"
            }
            Self::PartialNoise => "give `noise` to every [[output]], or to none",
            _ => "",
        }
    }
}

/// Rejected measurements, with the place in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataError {
    /// The reason.
    pub problem: DataProblem,
    file: String,
    /// Line of the file, from 1.
    pub line: Option<u64>,
    /// Name of the column.
    pub column: Option<String>,
    found: Option<String>,
    allowed: Option<String>,
}

impl DataError {
    fn found(mut self, found: impl fmt::Display) -> Self {
        self.found = Some(found.to_string());
        self
    }

    fn allowed(mut self, allowed: impl fmt::Display) -> Self {
        self.allowed = Some(allowed.to_string());
        self
    }

    fn in_column(mut self, name: &str) -> Self {
        self.column = Some(name.to_owned());
        self
    }
}

impl DataError {
    /// Describes it with its place.
    pub(super) fn into_input_error(self) -> InputError {
        let mut place = self.file;
        if let Some(line) = self.line {
            place += &format!(", line {line}");
        }
        if let Some(column) = self.column {
            place += &format!(", column {column}");
        }
        let mut input = InputError::new(self.problem).at(place);
        if let Some(found) = self.found {
            input = input.found(found);
        }
        if let Some(allowed) = self.allowed {
            input = input.allowed(allowed);
        }
        match self.problem.remedy() {
            "" => input,
            remedy => input.next(remedy),
        }
    }
}

/// Reads the measurements in `file`; see [`read`].
///
/// # Errors
/// Devices, pipes, folders and text in another encoding than UTF-8; as for [`read`].
pub(super) fn read_file(
    file: &Path,
    outputs: &[Output],
    t_end: f64,
) -> Result<Vec<Datum>, DataError> {
    let reader = Reader::new(file, outputs, t_end);
    let bytes =
        content(file).map_err(|error| reader.error(DataProblem::Unreadable).found(error))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        DataError {
            line: Some(line as u64),
            ..reader.error(DataProblem::NotUtf8)
        }
    })?;
    reader.read(text.strip_prefix('\u{feff}').unwrap_or(&text))
}

/// Reads measurements of `outputs` between 0 and `t_end`, sorted by time.
///
/// The text is either a plain table, with a column `t` or `time`, a column for each measured output and
/// optional columns NAME.noise of standard deviations; or PEtab's long table with the columns
/// `observableId`, `time`, `measurement` and optionally `noiseParameters`. An empty cell is not a measurement.
/// Columns are separated by commas, or by tabs if the header contains one.
///
/// # Errors
/// A [`DataError`] with the line and the column.
pub fn read(
    name: &Path,
    text: &str,
    outputs: &[Output],
    t_end: f64,
) -> Result<Vec<Datum>, DataError> {
    Reader::new(name, outputs, t_end).read(text)
}

struct Reader<'a> {
    file: String,
    outputs: &'a [Output],
    t_end: f64,
}

impl<'a> Reader<'a> {
    fn new(file: &Path, outputs: &'a [Output], t_end: f64) -> Self {
        Self {
            file: file.display().to_string(),
            outputs,
            t_end,
        }
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
        DataError {
            problem,
            file: self.file.clone(),
            line: None,
            column: None,
            found: None,
            allowed: None,
        }
    }

    /// Returns an error in a cell, or in a whole row.
    fn error_at(
        &self,
        problem: DataProblem,
        table: &Table,
        row: usize,
        column: Option<usize>,
    ) -> DataError {
        let name = column.and_then(|column| table.names.get(column));
        DataError {
            line: Some(table.lines[row]),
            column: name.cloned(),
            ..self.error(problem)
        }
    }

    fn column(&self, table: &Table, names: &[&str]) -> Result<usize, DataError> {
        let found = table
            .names
            .iter()
            .position(|name| names.contains(&name.as_str()));
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

    /// Rejects rows whose length differs from the header's: an empty cell marks a missing measurement, a missing cell a
    /// damaged file.
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

    /// Rejects columns that would change the meaning of measurements if they were ignored. Columns without
    /// any entry are accepted.
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

    /// Returns the number in a cell, or nothing if the cell is empty.
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
        let t = self
            .number(table, row, column)?
            .ok_or_else(|| error(DataProblem::MissingTime))?;
        match (0.0..=self.t_end).contains(&t) {
            true => Ok(t),
            false => Err(error(DataProblem::OutsideRun)
                .found(format!("t = {t} s"))
                .allowed(format!("0 to {} s, the scene's time.end", self.t_end))),
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
        let time = self.column(table, &["time"])?;
        let measurement = self.column(table, &["measurement"])?;
        let noise = table
            .names
            .iter()
            .position(|name| name == "noiseParameters");
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
            if let Some(value) = self.number(table, row, measurement)? {
                let noise = self.noise(table, row, noise, output)?;
                data.push(Datum {
                    t,
                    output,
                    value,
                    noise,
                });
            }
        }
        Ok(data)
    }

    fn plain(&self, table: &Table) -> Result<Vec<Datum>, DataError> {
        let time = self.column(table, &TIME)?;
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
                if let Some(value) = self.number(table, row, column)? {
                    let noise = self.noise(table, row, noise, output)?;
                    data.push(Datum {
                        t,
                        output,
                        value,
                        noise,
                    });
                }
            }
        }
        Ok(data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use DataProblem::*;

    fn outputs() -> Vec<Output> {
        [("tip", Some(0.1)), ("root", Some(0.2))]
            .map(|(name, noise)| Output::of_test(name, noise))
            .into()
    }

    fn read_text(text: &str) -> Result<Vec<Datum>, DataError> {
        read(Path::new("m.csv"), text, &outputs(), 2.0)
    }

    /// Plain tables and PEtab's tables, separated by commas or tabs, with the columns that do not change
    /// anything.
    #[test]
    fn equal_tables_of_both_forms_give_equal_measurements() {
        let plain = read_text("t,tip,root,tip.noise\n1,3,4,0.5\n0,1,,\n").unwrap();
        let long = read_text(
            "observableId,time,measurement,noiseParameters\ntip,0,1,\ntip,1,3,0.5\nroot,1,4,\n",
        )
        .unwrap();
        assert_eq!(plain, long);
        let tabs = "observableId\ttime\tmeasurement\tnoiseParameters\treplicateId\tobservableParameters\t\
                    simulationConditionId\tnoiseDistribution\n\
                    tip\t0\t1\t\tr1\t\tc\tnormal\ntip\t1\t3\t0.5\tr1\t\tc\t\nroot\t1\t4\t\tr2\t\tc\tnormal\n";
        assert_eq!(plain, read_text(tabs).unwrap());
        let noises: Vec<Option<f64>> = plain.iter().map(|datum| datum.noise).collect();
        assert_eq!(noises, [Some(0.1), Some(0.5), Some(0.2)]);
    }

    /// Each rejection names its line and column, also after blank lines.
    #[test]
    fn rejected_tables_name_the_line_and_the_column() {
        let long = |column: &str, entries: [&str; 2]| {
            format!(
                "observableId,time,measurement,{column}\ntip,0,1,{}\ntip,1,2,{}\n",
                entries[0], entries[1]
            )
        };
        let scaled = long("observableParameters", ["", "1000;0"]);
        let preequilibrated = long("preequilibrationConditionId", ["rest", "rest"]);
        let logarithmic = long("observableTransformation", ["lin", "log10"]);
        let laplace = long("noiseDistribution", ["laplace", "normal"]);
        let unit = long("unit", ["mm", "mm"]);
        let conditions = long("simulationConditionId", ["a", "b"]);
        for (text, problem, line, column) in [
            ("t,tip\n0,nan\n", NotANumber, Some(2), Some("tip")),
            ("t,tip\n0,1\n\n\n0.5,x\n", NotANumber, Some(5), Some("tip")),
            ("t,tip\n3,1\n", OutsideRun, Some(2), Some("t")),
            ("t,tip\n-1,1\n", OutsideRun, Some(2), Some("t")),
            ("t,tip\n,1\n", MissingTime, Some(2), Some("t")),
            ("t,tap\n0,1\n", UnknownOutput, None, Some("tap")),
            ("t,tip,unit\n0,1,mm\n", UnknownOutput, None, Some("unit")),
            (
                "t,tip,root.noise\n0,1,1\n",
                UnknownOutput,
                None,
                Some("root.noise"),
            ),
            ("x,tip\n0,1\n", MissingColumn, None, Some("t or time")),
            ("t,tip\n", Empty, None, None),
            ("\n", Empty, None, None),
            ("t,tip,tip\n0,1,1\n", DuplicateColumn, None, Some("tip")),
            ("t,tip\n0,1\n1\n", ShortRow, Some(3), None),
            ("t,tip\n0,1,5e-3\n", LongRow, Some(2), None),
            (
                "t,tip,tip.noise\n0,1,0\n",
                NonpositiveNoise,
                Some(2),
                Some("tip.noise"),
            ),
            (
                "observableId,time\ntip,1\n",
                MissingColumn,
                None,
                Some("measurement"),
            ),
            (
                &scaled,
                UnsupportedColumn,
                Some(3),
                Some("observableParameters"),
            ),
            (
                &preequilibrated,
                UnsupportedColumn,
                Some(2),
                Some("preequilibrationConditionId"),
            ),
            (
                &logarithmic,
                UnsupportedColumn,
                Some(3),
                Some("observableTransformation"),
            ),
            (
                &laplace,
                UnsupportedColumn,
                Some(2),
                Some("noiseDistribution"),
            ),
            (&unit, UnsupportedColumn, Some(2), Some("unit")),
            (
                &conditions,
                SeveralConditions,
                None,
                Some("simulationConditionId"),
            ),
        ] {
            let error = read_text(text).unwrap_err();
            let found = (error.problem, error.line, error.column.as_deref());
            assert_eq!(found, (problem, line, column), "{text:?}");
        }
    }

    #[test]
    fn files_that_are_not_text_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let latin = folder.path().join("latin.csv");
        std::fs::write(&latin, b"t,tip\n0,1\n1,\xe9\n").unwrap();
        let problem = |file: &Path| {
            let error = read_file(file, &outputs(), 2.0).unwrap_err();
            (error.problem, error.line)
        };
        assert_eq!(problem(&latin), (NotUtf8, Some(3)));
        // Devices and pipes never end.
        for device in ["/dev/zero", "/dev/null"] {
            assert_eq!(problem(Path::new(device)), (Unreadable, None));
        }
        assert_eq!(problem(folder.path()), (Unreadable, None));
    }
}

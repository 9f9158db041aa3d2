//! Rejected measurements.

use std::fmt;

use crate::InputError;

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
    /// A wave speed of zero or less, or a negative attenuation.
    NotAWave,
    /// A measurement without a time, frequency or load factor.
    MissingTime,
    /// A time before 0 or after the end of the run.
    OutsideRun,
    /// A frequency outside the range of the response.
    OutsideFrequencies,
    /// A load factor outside the range of the path.
    OutsideLoads,
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
                "this column would change the meaning of the measurements, which is not supported"
            }
            Self::SeveralConditions => "the file has measurements under several conditions",
            Self::UnknownOutput => "the scene has no such output",
            Self::ShortRow => "the row has fewer cells than the header",
            Self::LongRow => "the row has more cells than the header",
            Self::NotANumber => {
                "times, measurements and standard deviations must be finite numbers"
            }
            Self::NotAWave => {
                "a wave speed must be positive, and an attenuation must not be negative"
            }
            Self::MissingTime => "a measurement needs a time, frequency or load factor",
            Self::OutsideRun => "the time is outside the run",
            Self::OutsideFrequencies => "the frequency is outside the response",
            Self::OutsideLoads => "the load factor is outside the loading path",
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
            Self::PartialNoise => "give `noise` in every [[output]], or in no [[output]]",
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
    pub(super) fn new(problem: DataProblem, file: &str) -> Self {
        Self {
            problem,
            file: file.to_owned(),
            line: None,
            column: None,
            found: None,
            allowed: None,
        }
    }

    pub(super) fn at_line(mut self, line: u64) -> Self {
        self.line = Some(line);
        self
    }

    pub(super) fn found(mut self, found: impl fmt::Display) -> Self {
        self.found = Some(found.to_string());
        self
    }

    pub(super) fn allowed(mut self, allowed: impl fmt::Display) -> Self {
        self.allowed = Some(allowed.to_string());
        self
    }

    pub(super) fn in_column(mut self, name: &str) -> Self {
        self.column = Some(name.to_owned());
        self
    }

    /// Describes it with its place.
    pub(in crate::fit) fn into_input_error(self) -> InputError {
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

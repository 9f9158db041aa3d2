//! Errors for rejected measurements.

use std::fmt;

use crate::InputError;

/// Reason why measurements are rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(in crate::fit) enum DataProblem {
    #[error("cannot read the measurements")]
    Unreadable,
    #[error("the measurements are not UTF-8 text")]
    NotUtf8,
    #[error("the measurements are not a table")]
    NotATable,
    #[error("the file contains no measurements")]
    Empty,
    #[error("a column is missing")]
    MissingColumn,
    #[error("duplicate column name")]
    DuplicateColumn,
    #[error("this column would change the meaning of the measurements, which is not supported")]
    UnsupportedColumn,
    #[error("the file has measurements under several conditions")]
    SeveralConditions,
    #[error("the scene has no such output")]
    UnknownOutput,
    #[error("the row has fewer cells than the header")]
    ShortRow,
    #[error("the row has more cells than the header")]
    LongRow,
    #[error("times, measurements and standard deviations must be finite numbers")]
    NotANumber,
    #[error("a wave speed must be positive, and an attenuation must not be negative")]
    NotAWave,
    #[error("a measurement needs a time, frequency or load factor")]
    MissingTime,
    #[error("the time is outside the run")]
    OutsideRun,
    #[error("the frequency is outside the response")]
    OutsideFrequencies,
    #[error("the load factor is outside the loading path")]
    OutsideLoads,
    #[error("a standard deviation must be positive")]
    NonpositiveNoise,
    #[error("some measurements have a standard deviation, others do not")]
    PartialNoise,
}

impl DataProblem {
    /// Returns the suggested remedy; may be empty.
    fn remedy(self) -> &'static str {
        match self {
            Self::NotUtf8 => "save the file as UTF-8",
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
            Self::PartialNoise => "give `noise` in every [[output]], or in none",
            _ => "",
        }
    }
}

/// Error for rejected measurements, with its location in the file.
#[derive(Debug, Clone)]
pub(in crate::fit) struct DataError {
    pub(super) problem: DataProblem,
    file: String,
    /// One-based line number in the file.
    pub(super) line: Option<u64>,
    pub(super) column: Option<String>,
    /// The error without its location and remedy.
    input: InputError,
}

impl DataError {
    pub(super) fn new(problem: DataProblem, file: &str) -> Self {
        let input = InputError::new(problem);
        Self { problem, file: file.to_owned(), line: None, column: None, input }
    }

    pub(super) fn at_line(self, line: u64) -> Self {
        Self { line: Some(line), ..self }
    }

    pub(super) fn in_column(self, name: &str) -> Self {
        Self { column: Some(name.to_owned()), ..self }
    }

    pub(super) fn found(self, found: impl fmt::Display) -> Self {
        Self { input: self.input.found(found), ..self }
    }

    pub(super) fn allowed(self, allowed: impl fmt::Display) -> Self {
        Self { input: self.input.allowed(allowed), ..self }
    }

    /// Converts this error to an [`InputError`] with the location and the remedy.
    pub(in crate::fit) fn into_input_error(self) -> InputError {
        let mut place = self.file;
        if let Some(line) = self.line {
            place += &format!(", line {line}");
        }
        if let Some(column) = self.column {
            place += &format!(", column {column}");
        }
        let input = self.input.at(place);
        match self.problem.remedy() {
            "" => input,
            remedy => input.next(remedy),
        }
    }
}

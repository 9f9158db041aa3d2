//! What can go wrong with a factorisation, and what that means for a step.

use crate::ffi::klu::Failure;
use myovib_dae::StepError;

/// What can go wrong with a factorisation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KluError {
    /// The pattern is not square, or empty.
    #[error("a {rows} × {columns} pattern cannot be factorised: it must be square and not empty")]
    NotSquare {
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
    },
    /// The matrix is singular, by its pattern or by its values.
    #[error("the {n} × {n} matrix is singular{}", at_column(*column))]
    Singular {
        /// Order of the matrix.
        n: usize,
        /// The column in which no pivot was left, if KLU names one.
        column: Option<usize>,
    },
    /// An array has the wrong length.
    #[error("{what}: expected {expected}, got {got}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// The length it should have.
        expected: usize,
        /// The length it has.
        got: usize,
    },
    /// A value of the matrix is infinite or not a number.
    #[error("value {position} of the matrix is not finite")]
    NotFinite {
        /// Position in the array of values.
        position: usize,
    },
    /// There are no factors to solve with: none yet, or the last refactorisation failed.
    #[error("no factors to use: none were computed yet, or the last refactorisation failed")]
    NoFactors,
    /// KLU itself gave up: out of memory, or the problem is too large.
    #[error("KLU failed with status {status} ({})", status_name(*status))]
    Failed {
        /// KLU's status code.
        status: i64,
    },
}

fn at_column(column: Option<usize>) -> String {
    column
        .map(|c| format!(" (no pivot in column {c})"))
        .unwrap_or_default()
}

fn status_name(status: i64) -> &'static str {
    match status {
        -2 => "out of memory",
        -3 => "invalid matrix",
        -4 => "too large",
        _ => "unknown",
    }
}

/// A singular or infinite matrix may become a good one with a smaller step; nothing else may.
impl From<KluError> for StepError {
    fn from(error: KluError) -> Self {
        match error {
            KluError::Singular { .. } | KluError::NotFinite { .. } => {
                Self::Recoverable(error.to_string())
            }
            other => Self::Fatal(Box::new(other)),
        }
    }
}

impl KluError {
    pub(super) fn from_failure(n: usize, failure: Failure) -> Self {
        if failure.is_singular() {
            // KLU counts columns from 0 and says n for "none".
            let column = usize::try_from(failure.singular_column)
                .ok()
                .filter(|&c| c < n);
            Self::Singular { n, column }
        } else {
            Self::Failed {
                status: failure.status,
            }
        }
    }
}

//! What can go wrong with a factorisation, and what that means for a step.

use myovib_dae::StepError;

/// What can go wrong with a factorisation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SparseError {
    /// The pattern is not square, or empty.
    #[error("a {rows} × {columns} pattern cannot be factorised: it must be square and not empty")]
    NotSquare {
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
    },
    /// An unknown is in no equation.
    #[error("column {column} of the pattern is empty: unknown {column} is in no equation")]
    EmptyColumn {
        /// The first such column.
        column: usize,
    },
    /// The matrix is singular, by its pattern or by its values.
    #[error("the {n} × {n} matrix is singular{}", at_column(*column))]
    Singular {
        /// Order of the matrix.
        n: usize,
        /// The column in which no pivot was left, if known.
        column: Option<usize>,
    },
    /// A pivot was zero or not finite: another order, or exchanges of pivots, are needed.
    #[error("a pivot is zero or not finite in the fixed order of elimination")]
    ZeroPivot,
    /// Pivots must be exchanged, but the matrix is too large for a solver that does that.
    #[error(
        "the {n} × {n} matrix cannot be factorised with fixed pivots, and is too large to exchange them"
    )]
    TooLargeToPivot {
        /// Order of the matrix.
        n: usize,
    },
    /// The solution does not solve the system, even with exchange of pivots and refined.
    #[error(
        "the {n} × {n} matrix is too close to a singular one: backward error {backward_error:.1e}"
    )]
    Inaccurate {
        /// Order of the matrix.
        n: usize,
        /// Componentwise.
        backward_error: f64,
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
    /// A value of the matrix or of the right-hand side is infinite or not a number.
    #[error("value {position} of the {of} is not finite")]
    NotFinite {
        /// What it is a value of.
        of: &'static str,
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
    /// An [engine](crate::engine) gave up.
    #[error("{engine} failed: {reason}")]
    Engine {
        /// Its name.
        engine: &'static str,
        /// What it says.
        reason: String,
    },
    /// The factors will not fit.
    #[error(
        "the factors need {} of memory beside what is in use, and {} is left: take a coarser mesh or more \
         memory (`--memory` and the limits of a job count too){}",
        size(*needed), size(*available),
        if *n_complex > 0 { "; BDF needs one real matrix, Radau IIA complex ones beside it" } else { "" }
    )]
    Memory {
        /// What they need, B.
        needed: usize,
        /// What this process may take beside what it has, B.
        available: usize,
        /// How many of the matrices are complex.
        n_complex: usize,
    },
    /// The pool of threads could not be made.
    #[error("no pool of {threads} threads: {reason}")]
    Threads {
        /// How many were wanted.
        threads: usize,
        /// What the system says.
        reason: String,
    },
}

/// Checks the length of a slice.
///
/// # Errors
/// [`SparseError::WrongLength`].
pub(crate) fn expect_length(
    what: &'static str,
    expected: usize,
    got: usize,
) -> Result<(), SparseError> {
    if got == expected {
        return Ok(());
    }
    Err(SparseError::WrongLength {
        what,
        expected,
        got,
    })
}

/// A size for people.
fn size(bytes: usize) -> String {
    let mebibytes = bytes as f64 / f64::from(1 << 20);
    match mebibytes {
        0.0 => "nothing".to_owned(),
        small if small < 0.1 => format!("{:.1} KiB", 1024.0 * small),
        middle if middle < 1024.0 => format!("{middle:.1} MiB"),
        large => format!("{:.2} GiB", large / 1024.0),
    }
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
impl From<SparseError> for StepError {
    fn from(error: SparseError) -> Self {
        match error {
            SparseError::Singular { .. }
            | SparseError::NotFinite { .. }
            | SparseError::ZeroPivot
            | SparseError::TooLargeToPivot { .. }
            | SparseError::Inaccurate { .. } => Self::Recoverable(error.to_string()),
            other => Self::Fatal(Box::new(other)),
        }
    }
}

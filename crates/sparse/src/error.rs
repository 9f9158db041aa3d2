//! Errors of factorizations and their effect on a time step.

use myovib_dae::StepError;

/// Reason why a factorization or a solve failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum SparseError {
    /// The pattern is empty or not square.
    #[error("a {rows} × {columns} pattern cannot be factorized: it must be square and not empty")]
    NotSquare { rows: usize, columns: usize },
    /// A column of the pattern is empty.
    #[error("column {column} of the pattern is empty: no equation contains unknown {column}")]
    EmptyColumn {
        /// The first empty column.
        column: usize,
    },
    /// The matrix is structurally or numerically singular.
    #[error("the {n} × {n} matrix is singular{}", at_column(*column))]
    Singular {
        /// Order of the matrix.
        n: usize,
        /// The column without a pivot, if known.
        column: Option<usize>,
    },
    /// A pivot is zero or not finite. The matrix requires another order of elimination or pivoting.
    #[error("a pivot is zero or not finite in the fixed elimination order")]
    ZeroPivot,
    /// The matrix needs pivoting but is too large for the pivoting solver.
    #[error("the {n} × {n} matrix needs pivoting, but is too large for the pivoting solver")]
    TooLargeToPivot {
        /// Order of the matrix.
        n: usize,
    },
    /// The solution has a large backward error, even with pivoting and iterative refinement.
    #[error("the {n} × {n} matrix is nearly singular: backward error {backward_error:.1e}")]
    Inaccurate {
        /// Order of the matrix.
        n: usize,
        backward_error: f64,
    },
    /// An array has the wrong length.
    #[error("{what}: expected {expected}, got {got}")]
    WrongLength { what: &'static str, expected: usize, got: usize },
    /// An entry of the matrix or of the right-hand side is NaN or infinite.
    #[error("entry {position} of the {of} is not finite")]
    NotFinite { of: &'static str, position: usize },
    /// No factors are available: none were computed, or the last refactorization failed.
    #[error("no factors are available: none were computed, or the last refactorization failed")]
    NoFactors,
    /// KLU failed for another reason: it ran out of memory, or the problem is too large.
    #[error("KLU failed with status {status} ({})", status_name(*status))]
    Failed {
        /// KLU's status code.
        status: i64,
    },
    /// An [engine](crate::engine) failed.
    #[error("{engine} failed: {reason}")]
    Engine { engine: &'static str, reason: String },
    /// The factors do not fit into memory.
    #[error(
        "the factors need {} of memory, but only {} is available: use a coarser mesh, or provide more \
         memory (`--memory` and job limits count too){}",
         size(*needed), size(*available),
         if *n_complex > 0 { "; BDF needs one real matrix, Radau IIA additional complex ones" } else { "" }
    )]
    Memory {
        /// Required memory in bytes.
        needed: usize,
        /// Memory available to this process in bytes.
        available: usize,
        n_complex: usize,
    },
    /// The thread pool could not be created.
    #[error("cannot create a pool of {threads} threads: {reason}")]
    Threads {
        threads: usize,
        /// Message of the operating system.
        reason: String,
    },
}

/// Checks the length of an array.
///
/// # Errors
/// Returns [`SparseError::WrongLength`] if the lengths differ.
pub(crate) fn expect_length(
    what: &'static str,
    expected: usize,
    got: usize,
) -> Result<(), SparseError> {
    if got == expected {
        return Ok(());
    }
    Err(SparseError::WrongLength { what, expected, got })
}

/// Formats a number of bytes with a binary unit.
fn size(bytes: usize) -> String {
    let mebibytes = bytes as f64 / f64::from(1 << 20);
    match mebibytes {
        0.0 => "0 B".to_owned(),
        small if small < 0.1 => format!("{:.1} KiB", 1024.0 * small),
        middle if middle < 1024.0 => format!("{middle:.1} MiB"),
        large => format!("{:.2} GiB", large / 1024.0),
    }
}

fn at_column(column: Option<usize>) -> String {
    column.map(|c| format!(" (no pivot in column {c})")).unwrap_or_default()
}

fn status_name(status: i64) -> &'static str {
    match status {
        -2 => "out of memory",
        -3 => "invalid matrix",
        -4 => "too large",
        _ => "unknown",
    }
}

/// Errors caused by the values of the matrix are recoverable with a smaller step; all others are fatal.
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

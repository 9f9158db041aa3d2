//! Errors of the structural analysis.

use myovib_dae::StepError;
use myovib_sparse::SparseError;

/// Reason why a structural analysis failed.
#[derive(Debug, thiserror::Error)]
pub enum StructureError {
    /// The matrices of a pencil are not square or differ in size.
    #[error(
        "a pencil requires two square matrices of equal size, found {}x{} and {}x{}",
        e.0, e.1, a.0, a.1
    )]
    Shape {
        /// Rows and columns of E.
        e: (usize, usize),
        /// Rows and columns of A.
        a: (usize, usize),
    },
    /// An entry is NaN or infinite.
    #[error("entry ({row}, {column}) of {matrix} is {value}")]
    NotFinite {
        /// Name of the matrix.
        matrix: &'static str,
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// Value of the entry.
        value: f64,
    },
    /// The system could not be linearized at the given state.
    #[error("cannot evaluate the Jacobian at t = {t}: {source}")]
    Linearize {
        /// Time.
        t: f64,
        /// Error of the system.
        source: StepError,
    },
    /// The sizes of the matrices do not match.
    #[error("the {matrix} is {}x{}, expected {}x{}", got.0, got.1, expected.0, expected.1)]
    Sizes {
        /// Name of the matrix.
        matrix: &'static str,
        /// Rows and columns found.
        got: (usize, usize),
        /// Rows and columns expected.
        expected: (usize, usize),
    },
    /// The sparse factorization failed.
    #[error("cannot factorize the shifted matrix: {0}")]
    Factorize(#[from] SparseError),
    /// The eigenvalue iteration did not converge.
    #[error(
        "{converged} of {count} modes converged with {vectors} basis vectors: the shifted matrix is nearly singular"
    )]
    NotConverged {
        /// Number of converged modes.
        converged: usize,
        /// Requested number of modes.
        count: usize,
        /// Number of basis vectors.
        vectors: usize,
    },
}

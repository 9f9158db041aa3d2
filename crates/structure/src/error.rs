//! What can go wrong before a question about the structure has an answer.

use myovib_dae::StepError;
use myovib_sparse::SparseError;

/// Why a structural question could not be answered at all.
#[derive(Debug, thiserror::Error)]
pub enum StructureError {
    /// The matrices of a pencil are not square and of one size.
    #[error(
        "a pencil needs two square matrices of one size, not {}x{} and {}x{}",
        e.0, e.1, a.0, a.1
    )]
    Shape {
        /// Rows and columns of E.
        e: (usize, usize),
        /// Rows and columns of A.
        a: (usize, usize),
    },
    /// An entry is infinite or not a number.
    #[error("entry ({row}, {column}) of {matrix} is {value}")]
    NotFinite {
        /// The matrix, by its letter.
        matrix: &'static str,
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// The system could not be linearised at the state given.
    #[error("the Jacobian could not be evaluated at t = {t}: {source}")]
    Linearise {
        /// The time.
        t: f64,
        /// What the system said.
        source: StepError,
    },
    /// A matrix does not fit the others.
    #[error("the {matrix} is {}x{}, expected {}x{}", got.0, got.1, expected.0, expected.1)]
    Sizes {
        /// Which matrix.
        matrix: &'static str,
        /// Its rows and columns.
        got: (usize, usize),
        /// The rows and columns the others ask for.
        expected: (usize, usize),
    },
    /// The sparse factorisation failed.
    #[error("the shifted matrix could not be factorised: {0}")]
    Factorise(#[from] SparseError),
    /// The search for modes came to no end.
    #[error(
        "{converged} of {count} modes converged among {vectors} vectors: the shifted matrix is nearly singular"
    )]
    NotConverged {
        /// Modes found.
        converged: usize,
        /// Modes wanted.
        count: usize,
        /// Vectors tried.
        vectors: usize,
    },
}

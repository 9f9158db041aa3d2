//! Errors of the structural analysis.

use myovib_dae::StepError;
use myovib_sparse::SparseError;

/// Reason why a structural analysis failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
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
    NotFinite { matrix: &'static str, row: usize, column: usize, value: f64 },
    /// The system could not be linearized at the given state.
    #[error("cannot evaluate the Jacobian at t = {t}: {source}")]
    Linearize { t: f64, source: StepError },
    /// The sizes of the matrices do not match.
    #[error("the {matrix} is {}x{}, expected {}x{}", got.0, got.1, expected.0, expected.1)]
    Sizes { matrix: &'static str, got: (usize, usize), expected: (usize, usize) },
    /// The sparse factorization failed.
    #[error("cannot factorize the shifted matrix: {0}")]
    Factorize(#[from] SparseError),
    /// The eigenvalue iteration did not converge.
    #[error(
        "{converged} of {count} modes converged with {vectors} basis vectors: the shifted matrix is nearly singular"
    )]
    NotConverged { converged: usize, count: usize, vectors: usize },
}

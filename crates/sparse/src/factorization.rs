//! Common interface of all factorizations.

use std::ops::Add;

use myovib_dae::columns;

use crate::Scalar;
use crate::SparseError;

/// Symmetry of a matrix, known in advance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// Not symmetric.
    #[default]
    General,
    /// A = Aᵀ (not conjugated). The LDLᵀ factorization needs half the work and half the entries of LU.
    Symmetric,
}

/// Factors of a sequence of matrices with the same pattern.
///
/// The constructor analyzes the pattern. After the first solve, [`renew`](Self::renew) and [`solve`](Self::solve) do
/// not allocate.
pub trait Factorization<T: Scalar>: std::fmt::Debug + Send {
    /// Factorizes the matrix with the given `values`, in the order of the pattern.
    ///
    /// # Errors
    /// Returns an error if the factorization fails. No factors are available then.
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError>;

    /// Solves A x = b in place.
    ///
    /// # Errors
    /// Returns [`SparseError::NoFactors`] before the first matrix and after a failed factorization.
    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError>;

    /// Solves A X = B in place, with B stored by rows. The default implementation solves one column after the other.
    ///
    /// # Errors
    /// Returns the same errors as [`solve`](Self::solve).
    fn solve_columns(&mut self, x: &mut [T], n_columns: usize) -> Result<(), SparseError> {
        columns::one_by_one(x, n_columns, |column| self.solve(column))
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated).
    ///
    /// # Errors
    /// Returns the same errors as [`solve`](Self::solve).
    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError>;

    /// Returns the pivots of the last factors by unknown, that is, the diagonal of U or D. Returns `None` if rows and
    /// columns were permuted differently, or if the library does not provide the pivots.
    fn pivots(&self) -> Option<Vec<T>> {
        None
    }

    /// Returns the number of entries in the last factors, if known.
    fn n_entries(&self) -> Option<usize>;
}

/// Cost of a factorization, predicted from the pattern alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Number of entries in the factors, including explicit zeros.
    pub entries: usize,
    /// Memory in bytes for the matrix, the analysis, the factors and the workspace.
    pub bytes: usize,
    /// Number of floating-point operations of one factorization. A complex operation counts as four real operations.
    pub flops: f64,
}

/// Adds the costs of factorizations stored at the same time.
impl Add for Prediction {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            entries: self.entries + other.entries,
            bytes: self.bytes + other.bytes,
            flops: self.flops + other.flops,
        }
    }
}

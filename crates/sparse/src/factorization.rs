//! What all factorisations promise.

use std::ops::Add;

use myovib_dae::columns;

use crate::Scalar;
use crate::SparseError;

/// What is known of a matrix beyond its pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// Nothing.
    #[default]
    General,
    /// A = Aᵀ (not conjugated): LDLᵀ, half the work and half the entries.
    Symmetric,
}

/// The factors of matrices with one pattern, one after the other.
///
/// A constructor analyses the pattern; after the first solve neither [`renew`](Self::renew) nor
/// [`solve`](Self::solve) needs more memory.
pub trait Factorization<T: Scalar>: std::fmt::Debug + Send {
    /// Factorises the matrix with these `values`, in the order of the pattern.
    ///
    /// # Errors
    /// Those of a matrix without usable factors; there is nothing to solve with then.
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError>;

    /// Solves A x = b in place.
    ///
    /// # Errors
    /// [`SparseError::NoFactors`] before the first matrix and after one that was refused.
    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError>;

    /// Solves A X = B in place; the numbers of a row stand side by side. One column after the other
    /// where there is no better way.
    ///
    /// # Errors
    /// As for [`solve`](Self::solve).
    fn solve_columns(&mut self, x: &mut [T], n_columns: usize) -> Result<(), SparseError> {
        columns::one_by_one(x, n_columns, |column| self.solve(column))
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated).
    ///
    /// # Errors
    /// As for [`solve`](Self::solve).
    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError>;

    /// The pivots of the last factors by unknown, where rows and columns were eliminated in one order: those of U, or
    /// D. None where they are not told.
    fn pivots(&self) -> Option<Vec<T>> {
        None
    }

    /// Entries of the last factors, where the library tells.
    fn n_entries(&self) -> Option<usize>;
}

/// What a factorisation will need, known from the pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Entries of the factors, zeros added included.
    pub entries: usize,
    /// Bytes of matrix, analysis, factors and all that is needed to compute and to check them.
    pub bytes: usize,
    /// Floating-point operations of one factorisation: a complex one counts as four times as many.
    pub flops: f64,
}

/// Several factorisations that are kept beside each other.
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

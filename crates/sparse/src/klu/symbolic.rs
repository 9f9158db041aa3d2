//! Analysis of a pattern.

use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;

use crate::ffi::klu::RawSymbolic;
use crate::{SparseError, SparseOptions};

/// Analysis of a sparsity pattern: orderings and block triangular form.
///
/// Clones share the analysis, so real and complex matrices with the same pattern need only one analysis.
#[derive(Clone)]
pub struct Symbolic {
    pub(super) raw: Arc<RawSymbolic>,
}

impl Symbolic {
    /// Analyzes the compressed-column `pattern` (the major dimension is the column).
    ///
    /// # Errors
    /// Returns [`SparseError::NotSquare`], or [`SparseError::Failed`] if memory runs out. A structurally singular
    /// pattern is detected later, by the factorization.
    pub fn analyze(pattern: &SparsityPattern, options: SparseOptions) -> Result<Self, SparseError> {
        let (rows, columns) = (pattern.minor_dim(), pattern.major_dim());
        if rows != columns || rows == 0 {
            return Err(SparseError::NotSquare { rows, columns });
        }
        let raw = RawSymbolic::analyze(pattern, options)?;
        Ok(Self { raw: Arc::new(raw) })
    }

    /// Returns the order of the matrix.
    pub fn n(&self) -> usize {
        self.raw.n()
    }

    /// Returns the number of entries of the pattern.
    pub fn nnz(&self) -> usize {
        self.raw.nnz()
    }
}

impl std::fmt::Debug for Symbolic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Symbolic").field("n", &self.n()).field("nnz", &self.nnz()).finish()
    }
}

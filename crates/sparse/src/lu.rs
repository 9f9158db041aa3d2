//! Kernels of faer for the LU factorization with partial pivoting.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::lu::{
    LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra_sparse::pattern::SparsityPattern;

use crate::Scalar;
use crate::SparseError;
use crate::SparseOptions;

/// Analysis of a pattern.
#[derive(Debug, Clone)]
pub struct Symbolic {
    pattern: Arc<SparsityPattern>,
    lu: Arc<SymbolicLu<usize>>,
}

impl Symbolic {
    /// Analyzes the compressed-column `pattern` and orders it by COLAMD. The `options` are ignored.
    ///
    /// # Errors
    /// Returns [`SparseError::NotSquare`].
    pub fn analyze(
        pattern: &SparsityPattern,
        _options: SparseOptions,
    ) -> Result<Self, SparseError> {
        let (rows, columns) = (pattern.minor_dim(), pattern.major_dim());
        if rows != columns || rows == 0 {
            return Err(SparseError::NotSquare { rows, columns });
        }
        let lu = factorize_symbolic_lu(view(pattern), LuSymbolicParams::default())
            .map_err(|_| SparseError::Singular { n: rows, column: None })?;
        let pattern = Arc::new(pattern.clone());
        Ok(Self { pattern, lu: Arc::new(lu) })
    }

    /// Returns the order of the matrix.
    pub fn n(&self) -> usize {
        self.pattern.major_dim()
    }

    /// Returns the number of entries of the pattern.
    pub fn nnz(&self) -> usize {
        self.pattern.nnz()
    }
}

fn view(pattern: &SparsityPattern) -> SymbolicSparseColMatRef<'_, usize> {
    let (n, offsets) = (pattern.major_dim(), pattern.major_offsets());
    SymbolicSparseColMatRef::new_checked(n, n, offsets, None, pattern.minor_indices())
}

/// LU factors of a matrix, and their workspace.
pub struct Lu<T: Scalar> {
    symbolic: Symbolic,
    numeric: NumericLu<usize, T>,
    buffer: MemBuffer,
}

impl<T: Scalar> Lu<T> {
    /// Allocates factors and workspace.
    pub fn new(symbolic: Symbolic) -> Self {
        let lu = &symbolic.lu;
        let buffer = MemBuffer::new(StackReq::any_of(&[
            lu.factorize_numeric_lu_scratch::<T>(Par::Seq, Default::default()),
            lu.solve_in_place_scratch::<T>(1, Par::Seq),
            lu.solve_transpose_in_place_scratch::<T>(1, Par::Seq),
        ]));
        Self { buffer, numeric: NumericLu::new(), symbolic }
    }

    /// Returns the analysis.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// Factorizes the matrix with the given `values`. Returns `None` if the matrix is found to be singular.
    pub fn factor(&mut self, values: &[T]) -> Option<()> {
        let matrix = SparseColMatRef::new(view(&self.symbolic.pattern), values);
        let stack = MemStack::new(&mut self.buffer);
        let (lu, numeric) = (&self.symbolic.lu, &mut self.numeric);
        lu.factorize_numeric_lu(numeric, matrix, Par::Seq, stack, Default::default()).ok().map(drop)
    }

    /// Solves A x = b or Aᵀ x = b in place with the last factors.
    pub fn solve(&mut self, x: &mut [T], is_transposed: bool) {
        let x = MatMut::from_column_major_slice_mut(x, self.symbolic.n(), 1);
        let lu = LuRef::new_unchecked(&self.symbolic.lu, &self.numeric);
        let stack = MemStack::new(&mut self.buffer);
        match is_transposed {
            false => lu.solve_in_place_with_conj(Conj::No, x, Par::Seq, stack),
            true => lu.solve_transpose_in_place_with_conj(Conj::No, x, Par::Seq, stack),
        }
    }
}

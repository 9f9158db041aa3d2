//! The matrices IDAS hands to its linear solver: a sparse one with a fixed pattern, and an empty
//! one for solvers that keep their matrix to themselves.

use std::os::raw::c_int;
use std::ptr::NonNull;
use std::slice;

use nalgebra_sparse::pattern::SparsityPattern;
use sundials_sys::{
    _generic_SUNMatrix, CSC_MAT, SUNMatDestroy, SUNMatFreeEmpty, SUNMatNewEmpty, SUNMatrix,
    SUNMatrix_ID, SUNMatrix_ID_SUNMATRIX_CUSTOM, SUNSparseMatrix, SUNSparseMatrix_Data,
    SUNSparseMatrix_IndexPointers, SUNSparseMatrix_IndexValues, SUNSparseMatrix_NNZ,
};

use super::call::{CallFailed, NULL_RESULT};
use super::context::Context;
use super::pattern::widened;

/// An owned matrix.
pub(crate) struct Matrix {
    handle: NonNull<_generic_SUNMatrix>,
    free: unsafe extern "C" fn(SUNMatrix),
}

impl Matrix {
    /// A sparse matrix by columns. The pattern is written once; IDAS, which zeroes the matrix
    /// before every Jacobian, is given a zeroing operation that leaves it alone.
    ///
    /// # Panics
    /// If the pattern is not square, or has no entries.
    pub(crate) fn sparse(pattern: &SparsityPattern, context: &Context) -> Result<Self, CallFailed> {
        let (n, nnz) = (pattern.major_dim(), pattern.nnz());
        assert_eq!(pattern.minor_dim(), n, "a square pattern");
        assert!(nnz > 0, "a pattern with entries");
        let column_pointers = widened(pattern.major_offsets());
        let row_indices = widened(pattern.minor_indices());
        let (n, nnz) = (n as i64, nnz as i64);
        // SAFETY: the context is alive; the sizes are those of arrays in memory.
        let matrix = unsafe { SUNSparseMatrix(n, n, nnz, CSC_MAT as c_int, context.raw()) };
        let handle = NonNull::new(matrix).ok_or(CallFailed::new("SUNSparseMatrix", NULL_RESULT))?;
        let mut matrix = Self {
            handle,
            free: SUNMatDestroy,
        };
        // SAFETY: the matrix is sparse.
        let pointers = unsafe { SUNSparseMatrix_IndexPointers(matrix.raw()) };
        // SAFETY: a sparse matrix of order n owns n + 1 column pointers, zeroed at creation.
        let pointers = unsafe { slice::from_raw_parts_mut(pointers, column_pointers.len()) };
        pointers.copy_from_slice(&column_pointers);
        // SAFETY: the matrix is sparse.
        let indices = unsafe { SUNSparseMatrix_IndexValues(matrix.raw()) };
        // SAFETY: it owns nnz ≥ 1 row indices, zeroed at creation.
        let indices = unsafe { slice::from_raw_parts_mut(indices, row_indices.len()) };
        indices.copy_from_slice(&row_indices);
        matrix.ops().zero = Some(keep_as_is);
        Ok(matrix)
    }

    /// A matrix without entries.
    pub(crate) fn empty(context: &Context) -> Result<Self, CallFailed> {
        // SAFETY: the context is alive.
        let matrix = unsafe { SUNMatNewEmpty(context.raw()) };
        let handle = NonNull::new(matrix).ok_or(CallFailed::new("SUNMatNewEmpty", NULL_RESULT))?;
        let mut matrix = Self {
            handle,
            free: SUNMatFreeEmpty,
        };
        matrix.ops().getid = Some(custom_id);
        matrix.ops().zero = Some(keep_as_is);
        Ok(matrix)
    }

    pub(crate) fn raw(&self) -> SUNMatrix {
        self.handle.as_ptr()
    }

    fn ops(&mut self) -> &mut sundials_sys::_generic_SUNMatrix_Ops {
        // SAFETY: the handle is valid and borrowed uniquely.
        let matrix = unsafe { self.handle.as_mut() };
        // SAFETY: every SUNMatrix owns a table of operations.
        unsafe { &mut *matrix.ops }
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        // SAFETY: ours, freed here only, by the function that fits how it was made, before its
        // context and after the integrator that uses it (see `Ida`).
        unsafe { (self.free)(self.raw()) };
    }
}

/// The values of a sparse matrix, in the order of its pattern, set to zero.
///
/// # Safety
/// `matrix` came from [`Matrix::sparse`], and nothing else uses its values during `'a`.
pub(crate) unsafe fn zeroed_values<'a>(matrix: SUNMatrix) -> &'a mut [f64] {
    // SAFETY: the matrix is sparse, the caller's promise.
    let nnz = unsafe { SUNSparseMatrix_NNZ(matrix) } as usize;
    // SAFETY: as above.
    let data = unsafe { SUNSparseMatrix_Data(matrix) };
    // SAFETY: a sparse matrix owns nnz values, zeroed at creation; exclusive by the promise.
    let values = unsafe { slice::from_raw_parts_mut(data, nnz) };
    values.fill(0.0);
    values
}

unsafe extern "C" fn keep_as_is(_: SUNMatrix) -> c_int {
    0
}

unsafe extern "C" fn custom_id(_: SUNMatrix) -> SUNMatrix_ID {
    SUNMatrix_ID_SUNMATRIX_CUSTOM
}

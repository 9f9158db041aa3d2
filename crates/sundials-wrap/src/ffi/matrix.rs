//! Matrix that IDAS passes to its linear solver. It is empty, because the linear solver stores its matrix internally.

use std::os::raw::c_int;
use std::ptr::NonNull;

use sundials_sys::{
    _generic_SUNMatrix, SUNMatFreeEmpty, SUNMatNewEmpty, SUNMatrix, SUNMatrix_ID,
    SUNMatrix_ID_SUNMATRIX_CUSTOM,
};

use super::call::{CallFailed, NULL_RESULT};
use super::context::Context;

/// An owned matrix without entries.
pub(crate) struct Matrix(NonNull<_generic_SUNMatrix>);

impl Matrix {
    pub(crate) fn new(context: &Context) -> Result<Self, CallFailed> {
        // SAFETY: the context is alive.
        let matrix = unsafe { SUNMatNewEmpty(context.raw()) };
        let mut handle =
            NonNull::new(matrix).ok_or(CallFailed::new("SUNMatNewEmpty", NULL_RESULT))?;
        // SAFETY: the object was just created and is borrowed only here.
        let matrix = unsafe { handle.as_mut() };
        // SAFETY: every SUNMatrix owns a table of operations.
        let ops = unsafe { &mut *matrix.ops };
        ops.getid = Some(custom_id);
        ops.zero = Some(keep_as_is);
        Ok(Self(handle))
    }

    pub(crate) fn raw(&self) -> SUNMatrix {
        self.0.as_ptr()
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        // SAFETY: this value owns the matrix, which is freed only here, before its context and after the integrator
        // that uses it (see `Ida`).
        unsafe { SUNMatFreeEmpty(self.raw()) };
    }
}

unsafe extern "C" fn keep_as_is(_: SUNMatrix) -> c_int {
    0
}

unsafe extern "C" fn custom_id(_: SUNMatrix) -> SUNMatrix_ID {
    SUNMatrix_ID_SUNMATRIX_CUSTOM
}

//! The SUNDIALS context, which all other objects of one solver refer to.

use std::ptr;

use sundials_sys::{SUNContext, SUNContext_Create, SUNContext_Free, comm_no_mpi};

use super::call::{CallFailed, NULL_RESULT};
use crate::options::VectorArithmetic;

/// An owned context. It must be dropped after every object made with it.
pub(crate) struct Context {
    handle: SUNContext,
    vectors: VectorArithmetic,
}

impl Context {
    pub(crate) fn new(vectors: VectorArithmetic) -> Result<Self, CallFailed> {
        let mut context: SUNContext = ptr::null_mut();
        // SAFETY: no communicator, for serial use, and a place to write the handle to.
        let code = unsafe { SUNContext_Create(comm_no_mpi(), &mut context) };
        if code != 0 || context.is_null() {
            return Err(CallFailed::new("SUNContext_Create", NULL_RESULT));
        }
        let handle = context;
        Ok(Self { handle, vectors })
    }

    pub(crate) fn raw(&self) -> SUNContext {
        self.handle
    }

    /// Returns the implementation of the arithmetic of its vectors.
    pub(crate) fn vectors(&self) -> VectorArithmetic {
        self.vectors
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        let mut context = self.raw();
        // SAFETY: the handle is ours and freed here only; the owner drops it last (see `Ida`).
        unsafe { SUNContext_Free(&mut context) };
    }
}

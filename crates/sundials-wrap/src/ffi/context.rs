//! SUNDIALS context, to which all other objects of a solver refer.

use std::ptr;

use sundials_sys::{SUNContext, SUNContext_Create, SUNContext_Free, comm_no_mpi};

use super::call::{CallFailed, NULL_RESULT};
use crate::options::VectorArithmetic;

/// An owned context. It must be dropped after all objects that were created with it.
pub(crate) struct Context {
    handle: SUNContext,
    vectors: VectorArithmetic,
}

impl Context {
    pub(crate) fn new(vectors: VectorArithmetic) -> Result<Self, CallFailed> {
        let mut context: SUNContext = ptr::null_mut();
        // SAFETY: there is no communicator, for serial use, and the handle is written to a valid location.
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

    /// Returns the implementation of the vector arithmetic.
    pub(crate) fn vectors(&self) -> VectorArithmetic {
        self.vectors
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        let mut context = self.raw();
        // SAFETY: this value owns the handle, which is freed only here; the owner drops it last (see `Ida`).
        unsafe { SUNContext_Free(&mut context) };
    }
}

//! The SUNDIALS context, which all other objects of one solver refer to.

use std::ptr::{self, NonNull};

use sundials_sys::{_SUNContext, SUNContext, SUNContext_Create, SUNContext_Free};

use super::call::{CallFailed, NULL_RESULT};

/// An owned context. It must be dropped after every object made with it.
pub(crate) struct Context(NonNull<_SUNContext>);

impl Context {
    pub(crate) fn new() -> Result<Self, CallFailed> {
        let mut context: SUNContext = ptr::null_mut();
        // SAFETY: no communicator (null is for serial use), and a place to write the handle to.
        let code = unsafe { SUNContext_Create(ptr::null_mut(), &mut context) };
        match NonNull::new(context) {
            Some(context) if code == 0 => Ok(Self(context)),
            _ => Err(CallFailed::new("SUNContext_Create", NULL_RESULT)),
        }
    }

    pub(crate) fn raw(&self) -> SUNContext {
        self.0.as_ptr()
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        let mut context = self.raw();
        // SAFETY: the handle is ours and freed here only; the owner drops it last (see `Ida`).
        unsafe { SUNContext_Free(&mut context) };
    }
}

//! Messages of IDAS, which are passed to the callbacks; versions 6 and 7 differ in the mechanism.

use std::ffi::CStr;
use std::os::raw::{c_char, c_int, c_void};

use sundials_sys as sys;

use super::call::{CallFailed, check};
use super::callbacks::Callbacks;
use super::context::Context;
use super::trampoline::boundary;

pub(crate) use of_version::redirect_messages;

#[cfg(sundials = "6")]
mod of_version {
    use super::*;

    /// Redirects IDAS' messages to the callbacks instead of printing them.
    ///
    /// # Safety
    /// `memory` is a valid block of IDAS made with `_context`; `data` is the address of a pinned
    /// `Boundary<C>` that outlives it.
    pub(crate) unsafe fn redirect_messages<C: Callbacks>(
        _context: &Context,
        memory: *mut c_void,
        data: *mut c_void,
    ) -> Result<(), CallFailed> {
        // SAFETY: handler and data belong together, and the data outlive the memory block.
        let code = unsafe { sys::IDASetErrHandlerFn(memory, Some(message::<C>), data) };
        check("IDASetErrHandlerFn", code)
    }

    /// Implements IDAErrHandlerFn.
    ///
    /// # Safety
    /// As for [`take_message`].
    unsafe extern "C" fn message<C: Callbacks>(
        _code: c_int,
        _module: *const c_char,
        _function: *const c_char,
        text: *mut c_char,
        user_data: *mut c_void,
    ) {
        // SAFETY: the caller's promise.
        unsafe { take_message::<C>(text, user_data) };
    }
}

#[cfg(sundials = "7")]
mod of_version {
    use super::*;

    /// Redirects IDAS' messages to the callbacks instead of printing them, and discards its
    /// warnings, which IDAS would print among the results.
    ///
    /// # Safety
    /// `_memory` is a valid block of IDAS made with `context`; `data` is the address of a pinned
    /// `Boundary<C>` that outlives it.
    pub(crate) unsafe fn redirect_messages<C: Callbacks>(
        context: &Context,
        _memory: *mut c_void,
        data: *mut c_void,
    ) -> Result<(), CallFailed> {
        // SAFETY: the context is alive; a message to no logger is refused and lost.
        let code = unsafe { sys::SUNContext_SetLogger(context.raw(), std::ptr::null_mut()) };
        check("SUNContext_SetLogger", code)?;
        // SAFETY: the context is alive.
        let code = unsafe { sys::SUNContext_ClearErrHandlers(context.raw()) };
        check("SUNContext_ClearErrHandlers", code)?;
        // SAFETY: handler and data belong together, and the data outlive the memory block, which
        // alone reports to this context.
        let code =
            unsafe { sys::SUNContext_PushErrHandler(context.raw(), Some(message::<C>), data) };
        check("SUNContext_PushErrHandler", code)
    }

    /// Implements SUNErrHandlerFn.
    ///
    /// # Safety
    /// As for [`take_message`].
    unsafe extern "C" fn message<C: Callbacks>(
        _line: c_int,
        _function: *const c_char,
        _file: *const c_char,
        text: *const c_char,
        _code: c_int,
        user_data: *mut c_void,
        _context: sys::SUNContext,
    ) {
        // SAFETY: the caller's promise.
        unsafe { take_message::<C>(text, user_data) };
    }
}

/// Stores a message of IDAS instead of printing it.
///
/// # Safety
/// Called by IDAS with a zero-terminated string and the address given with the handler, while no
/// callback runs.
unsafe fn take_message<C: Callbacks>(text: *const c_char, user_data: *mut c_void) {
    // SAFETY: IDAS hands back the address of our boundary, and reports between callbacks.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS passes a zero-terminated string that lives during the call.
    let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
    boundary.callbacks.message(&text);
}

//! Messages from IDAS, which are passed to the callbacks. Versions 6 and 7 use different mechanisms.

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

    /// Passes messages of IDAS to the callbacks instead of printing them.
    ///
    /// # Safety
    /// `memory` is a valid block of IDAS created with `_context`. `data` is the address of a pinned `Boundary<C>` that
    /// outlives the block.
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
    /// The conditions of [`take_message`] apply.
    unsafe extern "C" fn message<C: Callbacks>(
        _code: c_int,
        _module: *const c_char,
        _function: *const c_char,
        text: *mut c_char,
        user_data: *mut c_void,
    ) {
        // SAFETY: guaranteed by the caller.
        unsafe { take_message::<C>(text, user_data) };
    }
}

#[cfg(sundials = "7")]
mod of_version {
    use super::*;

    /// Passes messages of IDAS to the callbacks instead of printing them. Discards warnings, which IDAS would otherwise
    /// print among the results.
    ///
    /// # Safety
    /// `_memory` is a valid block of IDAS created with `context`. `data` is the address of a pinned `Boundary<C>` that
    /// outlives the block.
    pub(crate) unsafe fn redirect_messages<C: Callbacks>(
        context: &Context,
        _memory: *mut c_void,
        data: *mut c_void,
    ) -> Result<(), CallFailed> {
        // SAFETY: the context is alive; without a logger, messages are discarded.
        let code = unsafe { sys::SUNContext_SetLogger(context.raw(), std::ptr::null_mut()) };
        check("SUNContext_SetLogger", code)?;
        // SAFETY: the context is alive.
        let code = unsafe { sys::SUNContext_ClearErrHandlers(context.raw()) };
        check("SUNContext_ClearErrHandlers", code)?;
        // SAFETY: handler and data belong together. The data outlive the memory block, and only this block reports to
        // the context.
        let code =
            unsafe { sys::SUNContext_PushErrHandler(context.raw(), Some(message::<C>), data) };
        check("SUNContext_PushErrHandler", code)
    }

    /// Implements SUNErrHandlerFn.
    ///
    /// # Safety
    /// The conditions of [`take_message`] apply.
    unsafe extern "C" fn message<C: Callbacks>(
        _line: c_int,
        _function: *const c_char,
        _file: *const c_char,
        text: *const c_char,
        _code: c_int,
        user_data: *mut c_void,
        _context: sys::SUNContext,
    ) {
        // SAFETY: guaranteed by the caller.
        unsafe { take_message::<C>(text, user_data) };
    }
}

/// Stores a message from IDAS instead of printing it.
///
/// # Safety
/// Must be called by IDAS with a zero-terminated string and the address that was passed with the handler, while no
/// callback is running.
unsafe fn take_message<C: Callbacks>(text: *const c_char, user_data: *mut c_void) {
    // SAFETY: IDAS passes back the address of our boundary, and reports only between callbacks.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS passes a zero-terminated string, valid during the call.
    let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
    boundary.callbacks.message(&text);
}

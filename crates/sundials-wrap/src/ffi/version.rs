//! Which SUNDIALS this is, and all that differs between its versions 6 and 7.

use std::ffi::CStr;
use std::os::raw::{c_char, c_int, c_void};

use sundials_sys as sys;

use super::call::{CallFailed, check};
use super::context::Context;
use super::trampoline::{Callbacks, take_message};

// Declared in sundials_version.h, which the bindings leave out; part of every SUNDIALS library.
unsafe extern "C" {
    fn SUNDIALSGetVersion(version: *mut c_char, length: c_int) -> c_int;
}

/// The version of the linked SUNDIALS, for example "6.4.1".
pub(crate) fn sundials() -> String {
    let mut buffer = [0u8; 64];
    // SAFETY: the buffer has the stated length; the function writes a zero-terminated string.
    unsafe { SUNDIALSGetVersion(buffer.as_mut_ptr().cast(), buffer.len() as c_int) };
    CStr::from_bytes_until_nul(&buffer)
        .map(|version| version.to_string_lossy().into_owned())
        .unwrap_or_default()
}

pub(crate) use of_version::*;

#[cfg(sundials = "6")]
mod of_version {
    use super::*;

    const _: () = assert!(
        sys::SUNDIALS_VERSION_MAJOR == 6,
        "the bindings are of another SUNDIALS than its headers"
    );

    /// What a linear solver answers when it fails for good.
    pub(crate) const SOLVE_FAILED: c_int = sys::SUNLS_PACKAGE_FAIL_UNREC;

    /// Lets IDAS hand its messages to the callbacks instead of printing them.
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

    /// IDAErrHandlerFn.
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

    const _: () = assert!(
        sys::SUNDIALS_VERSION_MAJOR == 7,
        "the bindings are of another SUNDIALS than its headers"
    );

    /// What a linear solver answers when it fails for good.
    pub(crate) const SOLVE_FAILED: c_int = sys::SUN_ERR_EXT_FAIL;

    /// Lets IDAS hand its messages to the callbacks instead of printing them, and its warnings to
    /// nobody: it would print them among our results.
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

    /// SUNErrHandlerFn.
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

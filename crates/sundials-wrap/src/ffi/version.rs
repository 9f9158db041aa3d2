//! Version of SUNDIALS, and names that differ between versions 6 and 7.

use std::ffi::CStr;
use std::os::raw::{c_char, c_int};

use sundials_sys as sys;

// Declared in sundials_version.h, which the bindings do not include. The function is part of every SUNDIALS library.
unsafe extern "C" {
    fn SUNDIALSGetVersion(version: *mut c_char, length: c_int) -> c_int;
}

/// Returns the version of the linked SUNDIALS, for example "6.4.1".
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
        "the bindings and the headers belong to different versions of SUNDIALS"
    );

    /// Code of an unrecoverable failure of a linear solver.
    pub(crate) const SOLVE_FAILED: c_int = sys::SUNLS_PACKAGE_FAIL_UNREC;
}

#[cfg(sundials = "7")]
mod of_version {
    use super::*;

    const _: () = assert!(
        sys::SUNDIALS_VERSION_MAJOR == 7,
        "the bindings and the headers belong to different versions of SUNDIALS"
    );

    /// Code of an unrecoverable failure of a linear solver.
    pub(crate) const SOLVE_FAILED: c_int = sys::SUN_ERR_EXT_FAIL;
}

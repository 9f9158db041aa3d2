//! The versions of the linked libraries, asked at run time.

use std::ffi::CStr;
use std::os::raw::{c_char, c_int};

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

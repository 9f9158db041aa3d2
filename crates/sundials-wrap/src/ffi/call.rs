//! Results of calls of C functions.

use std::os::raw::c_int;

use sundials_sys as sys;

/// Code reported if a C constructor returns a null pointer: out of memory.
pub(crate) const NULL_RESULT: i32 = sys::IDA_MEM_FAIL;

/// A call that IDAS rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CallFailed {
    pub(crate) call: &'static str,
    pub(crate) code: i32,
}

impl CallFailed {
    pub(crate) fn new(call: &'static str, code: i32) -> Self {
        Self { call, code }
    }
}

/// Converts a code other than success into the error of `call`.
pub(crate) fn check(call: &'static str, code: c_int) -> Result<(), CallFailed> {
    if code == sys::IDA_SUCCESS { Ok(()) } else { Err(CallFailed::new(call, code)) }
}

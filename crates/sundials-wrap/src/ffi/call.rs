//! Results of calls to C functions.

use std::os::raw::c_int;

use sundials_sys as sys;

/// Code reported if a C constructor returns a null pointer because memory ran out.
pub(crate) const NULL_RESULT: i32 = sys::IDA_MEM_FAIL;

/// A call rejected by IDAS.
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

/// Converts any code other than success to an error of `call`.
pub(crate) fn check(call: &'static str, code: c_int) -> Result<(), CallFailed> {
    if code == sys::IDA_SUCCESS { Ok(()) } else { Err(CallFailed::new(call, code)) }
}

//! Version of the linked SuiteSparse.

use super::klu::bindings::SuiteSparse_version;

/// Returns the version of the linked SuiteSparse, for example [5, 12, 0].
pub(crate) fn suite_sparse() -> [i32; 3] {
    let mut version = [0; 3];
    // SAFETY: the function writes three integers.
    unsafe { SuiteSparse_version(version.as_mut_ptr()) };
    version
}

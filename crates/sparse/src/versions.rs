//! The versions of the libraries underneath.

use suitesparse_sys::{KLU_MAIN_VERSION, KLU_SUB_VERSION, KLU_SUBSUB_VERSION};

use crate::ffi;

/// Versions of the linked libraries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// KLU, by its headers: the library cannot be asked.
    pub klu: String,
    /// SuiteSparse, the collection KLU belongs to, as it says itself at run time.
    pub suite_sparse: String,
}

impl Versions {
    /// Asks the libraries.
    pub fn linked() -> Self {
        let [major, minor, patch] = ffi::version::suite_sparse();
        Self {
            klu: format!("{KLU_MAIN_VERSION}.{KLU_SUB_VERSION}.{KLU_SUBSUB_VERSION}"),
            suite_sparse: format!("{major}.{minor}.{patch}"),
        }
    }
}

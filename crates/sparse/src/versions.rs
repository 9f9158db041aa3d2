//! The versions of the libraries underneath.

/// Versions of the linked libraries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// KLU, by its headers: the library cannot be asked.
    pub klu: String,
    /// SuiteSparse, the collection KLU belongs to, as it says itself at run time.
    pub suite_sparse: String,
}

impl Versions {
    /// Asks the libraries; `None` in a build without KLU.
    #[cfg(klu)]
    pub fn linked() -> Option<Self> {
        use crate::ffi::klu::bindings::{KLU_MAIN_VERSION, KLU_SUB_VERSION, KLU_SUBSUB_VERSION};

        let [major, minor, patch] = crate::ffi::version::suite_sparse();
        Some(Self {
            klu: format!("{KLU_MAIN_VERSION}.{KLU_SUB_VERSION}.{KLU_SUBSUB_VERSION}"),
            suite_sparse: format!("{major}.{minor}.{patch}"),
        })
    }

    /// Asks the libraries; `None` in a build without KLU.
    #[cfg(not(klu))]
    pub fn linked() -> Option<Self> {
        None
    }
}

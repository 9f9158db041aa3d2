//! Versions of the linked libraries.

/// Versions of the linked libraries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// Version of the KLU headers. The library does not report its version.
    pub klu: String,
    /// Version of SuiteSparse, the collection that contains KLU, reported at run time.
    pub suite_sparse: String,
}

impl Versions {
    /// Queries the versions from the libraries. Returns `None` in a build without KLU.
    #[cfg(klu)]
    pub fn linked() -> Option<Self> {
        use crate::ffi::klu::bindings::{KLU_MAIN_VERSION, KLU_SUB_VERSION, KLU_SUBSUB_VERSION};

        let [major, minor, patch] = crate::ffi::version::suite_sparse();
        Some(Self {
            klu: format!("{KLU_MAIN_VERSION}.{KLU_SUB_VERSION}.{KLU_SUBSUB_VERSION}"),
            suite_sparse: format!("{major}.{minor}.{patch}"),
        })
    }

    /// Returns `None`, because this build does not contain KLU.
    #[cfg(not(klu))]
    pub fn linked() -> Option<Self> {
        None
    }
}

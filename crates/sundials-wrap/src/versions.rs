//! The versions of the libraries underneath.

use crate::ffi;

/// Versions of the linked libraries, as they say themselves at run time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// SUNDIALS.
    pub sundials: String,
    /// SUNDIALS' headers this program was built with; a difference is a broken installation.
    pub sundials_headers: String,
    /// KLU, by its headers: the library cannot be asked.
    pub klu: String,
    /// SuiteSparse, the collection KLU belongs to.
    pub suite_sparse: String,
    /// Width of the indices of both, in bits.
    pub index_bits: usize,
}

impl Versions {
    /// Asks the libraries.
    pub fn linked() -> Self {
        use sundials_sys::{
            SUNDIALS_VERSION_MAJOR, SUNDIALS_VERSION_MINOR, SUNDIALS_VERSION_PATCH,
        };
        let sparse = myovib_sparse::Versions::linked();
        Self {
            sundials: ffi::version::sundials(),
            sundials_headers: format!(
                "{SUNDIALS_VERSION_MAJOR}.{SUNDIALS_VERSION_MINOR}.{SUNDIALS_VERSION_PATCH}"
            ),
            klu: sparse.klu,
            suite_sparse: sparse.suite_sparse,
            index_bits: sundials_sys::sunindextype::BITS as usize,
        }
    }
}

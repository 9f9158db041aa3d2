//! Versions of the linked libraries.

use crate::ffi;

/// Versions of the linked libraries, as reported at run time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// Version of SUNDIALS.
    pub sundials: String,
    /// Version of the SUNDIALS headers at build time. If it differs from `sundials`, the installation is broken.
    pub sundials_headers: String,
    /// Versions of KLU and SuiteSparse; `None` in a build without these libraries.
    pub sparse: Option<myovib_sparse::Versions>,
    /// Width of the SUNDIALS index type in bits.
    pub index_bits: usize,
}

impl Versions {
    /// Queries the versions from the libraries.
    pub fn linked() -> Self {
        use sundials_sys::{
            SUNDIALS_VERSION_MAJOR, SUNDIALS_VERSION_MINOR, SUNDIALS_VERSION_PATCH,
        };
        Self {
            sundials: ffi::version::sundials(),
            sundials_headers: format!(
                "{SUNDIALS_VERSION_MAJOR}.{SUNDIALS_VERSION_MINOR}.{SUNDIALS_VERSION_PATCH}"
            ),
            sparse: myovib_sparse::Versions::linked(),
            index_bits: sundials_sys::sunindextype::BITS as usize,
        }
    }
}

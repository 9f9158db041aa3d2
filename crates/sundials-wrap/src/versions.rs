//! Versions of the linked libraries.

use crate::ffi;

/// Versions of the linked libraries, as reported at run time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// SUNDIALS.
    pub sundials: String,
    /// Version of the SUNDIALS headers at build time; a difference indicates a broken installation.
    pub sundials_headers: String,
    /// Versions of KLU and SuiteSparse; `None` in a build without them.
    pub sparse: Option<myovib_sparse::Versions>,
    /// Width of SUNDIALS' index type in bits.
    pub index_bits: usize,
}

impl Versions {
    /// Queries the libraries.
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

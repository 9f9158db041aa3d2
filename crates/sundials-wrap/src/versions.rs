//! The versions of the libraries underneath.

use crate::ffi;

/// Versions of the linked libraries, as they say themselves at run time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Versions {
    /// SUNDIALS.
    pub sundials: String,
    /// SUNDIALS' headers this program was built with; a difference is a broken installation.
    pub sundials_headers: String,
    /// KLU and its collection, SuiteSparse; `None` in a build without.
    pub sparse: Option<myovib_sparse::Versions>,
    /// Width of the indices of SUNDIALS, in bits.
    pub index_bits: usize,
}

impl Versions {
    /// Asks the libraries.
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

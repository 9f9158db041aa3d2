//! KLU factorisations with 64-bit indices, real and complex.
//!
//! Life cycle: [`RawSymbolic`] (analysis of a pattern) → [`RawNumeric`] (factors of one matrix with
//! that pattern, refactored in place) → dropped in any order, the numeric object holding the
//! symbolic one alive. [`Entry`] says which functions of KLU serve which kind of number.

#[allow(
    clippy::all,
    clippy::undocumented_unsafe_blocks,
    dead_code,
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    unreachable_pub
)]
pub(crate) mod bindings {
    //! What bindgen makes of klu.h.
    include!(concat!(env!("OUT_DIR"), "/klu.rs"));
}
mod entry;
mod numeric;
mod symbolic;

use crate::options::RawOptions;
use bindings::{KLU_SINGULAR, klu_l_common, klu_l_defaults};

pub(crate) use entry::Entry;
pub(crate) use numeric::RawNumeric;
pub(crate) use symbolic::RawSymbolic;

impl RawOptions {
    /// Writes the settings into a control block of KLU.
    pub(crate) fn write_to(self, common: &mut klu_l_common) {
        common.ordering = self.ordering;
        common.btf = self.btf;
        common.scale = self.scale;
        common.tol = self.pivot_tolerance;
    }
}

/// What KLU's control block says after a call that failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Failure {
    /// KLU's status code.
    pub(crate) status: i64,
    /// Column at which the matrix was found singular; outside of 0..n if none was.
    pub(crate) singular_column: i64,
}

impl Failure {
    fn of(common: &klu_l_common) -> Self {
        Self {
            status: common.status,
            singular_column: common.singular_col,
        }
    }

    /// Whether the matrix is singular (as opposed to lack of memory or a bad argument).
    pub(crate) fn is_singular(&self) -> bool {
        self.status == i64::from(KLU_SINGULAR)
    }
}

/// KLU's control block with its own defaults.
fn default_common() -> klu_l_common {
    let mut common = std::mem::MaybeUninit::<klu_l_common>::zeroed();
    // SAFETY: the pointer is to writable memory of the right size; klu_l_defaults only writes.
    unsafe { klu_l_defaults(common.as_mut_ptr()) };
    // SAFETY: all-zero bytes are a valid control block (numbers, null pointers, no function), and
    // klu_l_defaults has since set every parameter.
    unsafe { common.assume_init() }
}

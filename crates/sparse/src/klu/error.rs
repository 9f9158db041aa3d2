//! KLU's failures as errors of the crate.

use crate::SparseError;
use crate::ffi::klu::Failure;

/// What KLU said of an `n` × `n` matrix.
pub(super) fn from_failure(n: usize, failure: Failure) -> SparseError {
    if failure.is_singular() {
        // KLU counts columns from 0 and says n for "none".
        let column = usize::try_from(failure.singular_column)
            .ok()
            .filter(|&c| c < n);
        SparseError::Singular { n, column }
    } else {
        SparseError::Failed {
            status: failure.status,
        }
    }
}

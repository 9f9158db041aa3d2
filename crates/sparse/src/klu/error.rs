//! Conversion of KLU's failures to errors of this crate.

use crate::SparseError;
use crate::ffi::klu::Failure;

/// Converts a failure for an `n` × `n` matrix.
pub(super) fn from_failure(n: usize, failure: Failure) -> SparseError {
    if failure.is_singular() {
        // KLU counts columns from 0 and returns n if the column is unknown.
        let column = usize::try_from(failure.singular_column).ok().filter(|&c| c < n);
        SparseError::Singular { n, column }
    } else {
        SparseError::Failed { status: failure.status }
    }
}

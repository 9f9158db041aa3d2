//! Rejects NaN and infinite entries before factorizing or solving.

use num_complex::ComplexFloat;

use crate::SparseError;

/// Checks that all `values` are finite; `of` is the name of the array.
///
/// # Errors
/// Returns [`SparseError::NotFinite`] for the first value that is not finite.
pub(crate) fn expect_finite<T: ComplexFloat>(
    values: &[T],
    of: &'static str,
) -> Result<(), SparseError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(position) => Err(SparseError::NotFinite { of, position }),
        None => Ok(()),
    }
}

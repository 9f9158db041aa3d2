//! Numbers that are none are refused before they are factorised or solved for.

use num_complex::ComplexFloat;

use crate::SparseError;

/// Checks that all parts of all `values` of something are finite.
///
/// # Errors
/// [`SparseError::NotFinite`].
pub(crate) fn expect_finite<T: ComplexFloat>(
    values: &[T],
    of: &'static str,
) -> Result<(), SparseError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(position) => Err(SparseError::NotFinite { of, position }),
        None => Ok(()),
    }
}

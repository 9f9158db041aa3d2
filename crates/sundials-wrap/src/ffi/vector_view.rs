//! Access to serial vectors, including vectors of IDAS, as slices.

use std::slice;

use sundials_sys::{N_VConst, N_VGetArrayPointer_Serial, N_VGetLength_Serial, N_Vector};

/// Returns the entries of a serial vector.
///
/// # Safety
/// `vector` is a valid serial vector with initialized entries, and nothing writes to them during `'a`.
pub(crate) unsafe fn view<'a>(vector: N_Vector) -> &'a [f64] {
    // SAFETY: the caller guarantees that the vector is serial.
    let length = unsafe { N_VGetLength_Serial(vector) } as usize;
    // SAFETY: as above.
    let data = unsafe { N_VGetArrayPointer_Serial(vector) };
    // SAFETY: a serial vector of positive length owns that many doubles. The caller guarantees that they are
    // initialized and that nothing writes to them during 'a.
    unsafe { slice::from_raw_parts(data, length) }
}

/// Returns the entries of a serial vector as a mutable slice.
///
/// # Safety
/// The conditions of [`view`] apply, and nothing else reads or writes the entries during `'a`.
pub(crate) unsafe fn view_mut<'a>(vector: N_Vector) -> &'a mut [f64] {
    // SAFETY: the caller guarantees that the vector is serial.
    let length = unsafe { N_VGetLength_Serial(vector) } as usize;
    // SAFETY: as above.
    let data = unsafe { N_VGetArrayPointer_Serial(vector) };
    // SAFETY: as in `view`; the caller guarantees exclusive access during 'a.
    unsafe { slice::from_raw_parts_mut(data, length) }
}

/// Sets the entries of a serial vector to zero and returns them. The entries may be uninitialized.
///
/// # Safety
/// The conditions of [`view_mut`] apply, except that the entries may be uninitialized.
pub(crate) unsafe fn zeroed_mut<'a>(vector: N_Vector) -> &'a mut [f64] {
    // SAFETY: the caller guarantees that the vector is valid; this call initializes its entries.
    unsafe { N_VConst(0.0, vector) };
    // SAFETY: the entries have just been initialized; the caller guarantees the other conditions.
    unsafe { view_mut(vector) }
}

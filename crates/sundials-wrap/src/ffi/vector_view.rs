//! Access to serial vectors, including vectors of IDAS, as slices.

use std::slice;

use sundials_sys::{N_VConst, N_VGetArrayPointer_Serial, N_VGetLength_Serial, N_Vector};

/// Returns the entries of a serial vector.
///
/// # Safety
/// `vector` is a valid serial vector of initialized entries, not written to during `'a`.
pub(crate) unsafe fn view<'a>(vector: N_Vector) -> &'a [f64] {
    // SAFETY: the vector is serial, the caller's promise.
    let length = unsafe { N_VGetLength_Serial(vector) } as usize;
    // SAFETY: as above.
    let data = unsafe { N_VGetArrayPointer_Serial(vector) };
    // SAFETY: a serial vector of positive length owns that many doubles; initialized and unwritten
    // for 'a by the caller's promise.
    unsafe { slice::from_raw_parts(data, length) }
}

/// Returns the mutable entries of a serial vector.
///
/// # Safety
/// As for [`view`], and nothing else reads or writes the entries during `'a`.
pub(crate) unsafe fn view_mut<'a>(vector: N_Vector) -> &'a mut [f64] {
    // SAFETY: the vector is serial, the caller's promise.
    let length = unsafe { N_VGetLength_Serial(vector) } as usize;
    // SAFETY: as above.
    let data = unsafe { N_VGetArrayPointer_Serial(vector) };
    // SAFETY: as in `view`; exclusive for 'a by the caller's promise.
    unsafe { slice::from_raw_parts_mut(data, length) }
}

/// Sets the entries of a serial vector, possibly uninitialized, to zero and returns them.
///
/// # Safety
/// As for [`view_mut`], except that the entries need not be initialized.
pub(crate) unsafe fn zeroed_mut<'a>(vector: N_Vector) -> &'a mut [f64] {
    // SAFETY: the vector is valid, the caller's promise; this initializes its entries.
    unsafe { N_VConst(0.0, vector) };
    // SAFETY: initialized just now; the rest is the caller's promise.
    unsafe { view_mut(vector) }
}

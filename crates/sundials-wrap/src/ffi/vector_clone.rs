//! Initialized clones of vectors.
//!
//! SUNDIALS does not initialize the entries of a clone. IDAS returns some of its clones before it
//! has written to them: the error weights and the estimated errors before the first step, which
//! safe code may request.

use sundials_sys::{N_VClone_Serial, N_VConst, N_Vector};

use super::vector::NVector;

/// Makes all clones of `vector`, and their clones, start as vectors of zeros.
pub(super) fn zero_clones_of(vector: &mut NVector) {
    // SAFETY: ours, valid, and borrowed uniquely.
    let vector = unsafe { &mut *vector.raw() };
    // SAFETY: every serial vector owns a table of operations, which its clones inherit.
    let operations = unsafe { &mut *vector.ops };
    operations.nvclone = Some(zeroed_clone);
}

/// Returns a clone of `vector` filled with zeros, or null if out of memory.
///
/// # Safety
/// As for N_VClone_Serial: `vector` is a valid serial vector.
unsafe extern "C" fn zeroed_clone(vector: N_Vector) -> N_Vector {
    // SAFETY: the caller's promise.
    let clone = unsafe { N_VClone_Serial(vector) };
    if !clone.is_null() {
        // SAFETY: a serial vector just made, which nothing else refers to.
        unsafe { N_VConst(0.0, clone) };
    }
    clone
}

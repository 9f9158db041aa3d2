//! Initialized clones of vectors.
//!
//! SUNDIALS does not initialize the entries of a clone. IDAS returns some of its clones before writing to them: the
//! error weights and the estimated errors before the first step, which safe code may request.

use sundials_sys::{N_VClone_Serial, N_VConst, N_Vector};

use super::vector::NVector;

/// Makes SUNDIALS initialize all clones of `vector`, and clones of these clones, to zeros.
pub(super) fn zero_clones_of(vector: &mut NVector) {
    // SAFETY: the vector is valid, owned and borrowed uniquely.
    let vector = unsafe { &mut *vector.raw() };
    // SAFETY: every serial vector owns a table of operations, which its clones inherit.
    let operations = unsafe { &mut *vector.ops };
    operations.nvclone = Some(zeroed_clone);
}

/// Returns a clone of `vector` filled with zeros, or null if memory runs out.
///
/// # Safety
/// The condition of N_VClone_Serial applies: `vector` is a valid serial vector.
unsafe extern "C" fn zeroed_clone(vector: N_Vector) -> N_Vector {
    // SAFETY: guaranteed by the caller.
    let clone = unsafe { N_VClone_Serial(vector) };
    if !clone.is_null() {
        // SAFETY: the clone is a new serial vector to which nothing else refers.
        unsafe { N_VConst(0.0, clone) };
    }
    clone
}

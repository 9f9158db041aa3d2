//! Serial vectors owned by this crate.

use std::ptr::NonNull;

use sundials_sys::{_generic_N_Vector, N_VConst, N_VDestroy, N_VNew_Serial, N_Vector};

use super::call::{CallFailed, NULL_RESULT};
use super::context::Context;
use super::vector_operations;
use super::vector_view::{view, view_mut};
use crate::options::VectorArithmetic;

/// An owned serial vector, initialized to zeros.
pub(crate) struct NVector(NonNull<_generic_N_Vector>);

impl NVector {
    /// Creates a vector of `n` zeros, where `n` ≥ 1.
    pub(crate) fn zeros(n: usize, context: &Context) -> Result<Self, CallFailed> {
        // SAFETY: the context is alive; the length of an array in memory fits in 64 bits.
        let vector = unsafe { N_VNew_Serial(n as i64, context.raw()) };
        let vector = NonNull::new(vector).ok_or(CallFailed::new("N_VNew_Serial", NULL_RESULT))?;
        // SAFETY: the vector was just created; this call initializes its n entries.
        unsafe { N_VConst(0.0, vector.as_ptr()) };
        if context.vectors() == VectorArithmetic::Simd {
            // SAFETY: as above.
            unsafe { vector_operations::install(vector.as_ptr()) };
        }
        Ok(Self(vector))
    }

    pub(crate) fn from_slice(values: &[f64], context: &Context) -> Result<Self, CallFailed> {
        let mut vector = Self::zeros(values.len(), context)?;
        vector.as_mut_slice().copy_from_slice(values);
        Ok(vector)
    }

    pub(crate) fn as_slice(&self) -> &[f64] {
        // SAFETY: this value owns the serial vector, which was initialized at creation. During the borrow of self, the
        // vector is alive and C does not write to it (C does so only in calls that take `&mut` of the owner).
        unsafe { view(self.raw()) }
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [f64] {
        // SAFETY: as above, with a unique borrow.
        unsafe { view_mut(self.raw()) }
    }

    pub(crate) fn raw(&self) -> N_Vector {
        self.0.as_ptr()
    }
}

impl Drop for NVector {
    fn drop(&mut self) {
        // SAFETY: this value owns the vector, which is freed only here, before its context (see `Ida`).
        unsafe { N_VDestroy(self.raw()) };
    }
}

//! Factors of a matrix.

use std::cell::UnsafeCell;
use std::marker::PhantomData;
use std::ptr::{self, NonNull};
use std::sync::Arc;

use super::bindings::{KLU_OK, klu_l_common, klu_l_numeric};
use super::entry::{Diagnose, Entry, Refactor};
use super::symbolic::RawSymbolic;
use super::{default_common, error};
use crate::SparseError;

/// Return value of KLU for success.
const TRUE: i64 = 1;

/// LU factors of one matrix.
///
/// Not `Sync`: a solve uses workspace inside the numeric object.
pub(crate) struct RawNumeric<T: Entry> {
    handle: NonNull<klu_l_numeric>,
    symbolic: Arc<RawSymbolic>,
    common: UnsafeCell<klu_l_common>,
    entry: PhantomData<T>,
}

// SAFETY: this value owns the handle and the control block, and the shared symbolic object is Sync. Nothing is bound to
// a thread.
unsafe impl<T: Entry> Send for RawNumeric<T> {}

impl<T: Entry> RawNumeric<T> {
    /// Factorizes the matrix with the pattern of `symbolic` and the given `values`.
    ///
    /// # Panics
    /// Panics if the number of values differs from the number of entries of the pattern.
    pub(crate) fn factor(symbolic: Arc<RawSymbolic>, values: &[T]) -> Result<Self, SparseError> {
        let doubles = as_doubles(&symbolic, values);
        let mut common = default_common();
        symbolic.options.write_to(&mut common);
        let guard = symbolic.lock();
        // SAFETY: pattern and values have matching lengths; the symbolic object belongs to this pattern and is locked
        // against a concurrent factorization; KLU only reads the arrays.
        let handle = unsafe {
            (T::FUNCTIONS.factor)(
                symbolic.ap(),
                symbolic.ai(),
                doubles,
                symbolic.handle.as_ptr(),
                &mut common,
            )
        };
        drop(guard);
        let handle = NonNull::new(handle);
        if common.status == i64::from(KLU_OK)
            && let Some(handle) = handle
        {
            let common = UnsafeCell::new(common);
            return Ok(Self { handle, symbolic, common, entry: PhantomData });
        }
        let failure = error(&common, symbolic.n());
        if let Some(handle) = handle {
            let mut handle = handle.as_ptr();
            // SAFETY: the factor function has just returned the handle, and it is freed only here.
            unsafe { (T::FUNCTIONS.free)(&mut handle, &mut common) };
        }
        Err(failure)
    }

    /// Recomputes the factors for new `values` with the same pivots.
    ///
    /// # Panics
    /// Panics if the number of values differs from the number of entries of the pattern.
    pub(crate) fn refactor(&mut self, values: &[T]) -> Result<(), SparseError> {
        self.with_matrix(T::FUNCTIONS.refactor, values)
    }

    /// Returns the reciprocal pivot growth for the matrix with the given `values`.
    ///
    /// # Panics
    /// Panics if the number of values differs from the number of entries of the pattern.
    pub(crate) fn rgrowth(&self, values: &[T]) -> Result<f64, SparseError> {
        self.with_matrix(T::FUNCTIONS.rgrowth, values)?;
        Ok(self.common().rgrowth)
    }

    /// Returns a cheap estimate of the reciprocal condition number: min |u_kk| / max |u_kk|.
    pub(crate) fn rcond(&self) -> Result<f64, SparseError> {
        self.diagnose(T::FUNCTIONS.rcond)?;
        Ok(self.common().rcond)
    }

    /// Returns the number of entries of L and U, including the two diagonals but not the off-diagonal blocks.
    pub(crate) fn n_entries(&self) -> usize {
        // SAFETY: the handle is valid for the lifetime of self; only two integers are read.
        let numeric = unsafe { self.handle.as_ref() };
        (numeric.lnz + numeric.unz) as usize
    }

    /// Solves A x = b, or Aᵀ x = b, in place for the columns of `rhs`.
    ///
    /// # Panics
    /// Panics if the length of `rhs` is not a multiple of the order of the matrix.
    pub(crate) fn solve(&self, rhs: &mut [T], transposed: bool) -> Result<(), SparseError> {
        let n = self.symbolic.n();
        assert_eq!(rhs.len() % n, 0, "whole columns");
        let functions = T::FUNCTIONS;
        let solve = if transposed { functions.solve_transposed } else { functions.solve };
        // SAFETY: rhs contains whole columns of length n in KLU's layout. The workspace inside the numeric object is
        // not shared, since self is not Sync and KLU has no callbacks. The control block is not borrowed elsewhere.
        let ok = unsafe {
            solve(
                self.symbolic.handle.as_ptr(),
                self.handle.as_ptr(),
                n as i64,
                (rhs.len() / n) as i64,
                rhs.as_mut_ptr().cast(),
                self.common.get(),
            )
        };
        self.check(ok)
    }

    fn with_matrix(&self, function: Refactor, values: &[T]) -> Result<(), SparseError> {
        let doubles = as_doubles(&self.symbolic, values);
        // SAFETY: pattern and values match, and the handles belong together. Only refactor writes to the numeric
        // object; it requires &mut self, and no reference into the object exists.
        let ok = unsafe {
            function(
                self.symbolic.ap(),
                self.symbolic.ai(),
                doubles,
                self.symbolic.handle.as_ptr(),
                self.handle.as_ptr(),
                self.common.get(),
            )
        };
        self.check(ok)
    }

    fn diagnose(&self, function: Diagnose) -> Result<(), SparseError> {
        let (symbolic, numeric) = (self.symbolic.handle.as_ptr(), self.handle.as_ptr());
        // SAFETY: both handles are valid and belong together; the function only reads them.
        let ok = unsafe { function(symbolic, numeric, self.common.get()) };
        self.check(ok)
    }

    fn common(&self) -> klu_l_common {
        // SAFETY: KLU initialized the block; self is not Sync, so there are no concurrent writes.
        unsafe { ptr::read(self.common.get()) }
    }

    fn check(&self, ok: i64) -> Result<(), SparseError> {
        let common = self.common();
        if ok == TRUE && common.status == i64::from(KLU_OK) {
            Ok(())
        } else {
            Err(error(&common, self.symbolic.n()))
        }
    }
}

impl<T: Entry> std::fmt::Debug for RawNumeric<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RawNumeric").field("n_entries", &self.n_entries()).finish_non_exhaustive()
    }
}

impl<T: Entry> Drop for RawNumeric<T> {
    fn drop(&mut self) {
        let mut handle = self.handle.as_ptr();
        // SAFETY: the handle came from the factor function of the same scalar type and is freed only here; the symbolic
        // object is still alive (the call does not use it).
        unsafe { (T::FUNCTIONS.free)(&mut handle, self.common.get_mut()) };
    }
}

/// Returns the values of a matrix with the pattern of `symbolic` as an array of doubles.
fn as_doubles<T: Entry>(symbolic: &RawSymbolic, values: &[T]) -> *mut f64 {
    let nnz = symbolic.nnz();
    assert_eq!(values.len(), nnz, "one value per entry of the pattern");
    values.as_ptr().cast::<f64>().cast_mut()
}

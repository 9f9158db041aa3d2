//! Analysis of a pattern.

use std::ptr::NonNull;
use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra_sparse::pattern::SparsityPattern;

use super::bindings::{klu_l_analyze, klu_l_free_symbolic, klu_l_symbolic};
use super::{default_common, error};
use crate::{SparseError, SparseOptions};

/// Analysis of one pattern, together with the pattern.
pub(crate) struct RawSymbolic {
    pub(super) handle: NonNull<klu_l_symbolic>,
    column_pointers: Box<[i64]>,
    row_indices: Box<[i64]>,
    pub(super) options: SparseOptions,
    /// Held during klu_l_factor, which writes revised size estimates to the symbolic object. All other functions read
    /// only the constant parts.
    factor_lock: Mutex<()>,
}

// SAFETY: this value owns the handle, and KLU has no thread-local state, so any thread may use and free it.
unsafe impl Send for RawSymbolic {}
// SAFETY: klu_l_factor is the only KLU function that writes to the symbolic object. It runs under `factor_lock` and
// writes `Lnz`, which no other function called here reads.
unsafe impl Sync for RawSymbolic {}

impl RawSymbolic {
    /// Analyzes a compressed-column pattern.
    ///
    /// # Panics
    /// Panics if the pattern is not square.
    pub(crate) fn analyze(
        pattern: &SparsityPattern,
        options: SparseOptions,
    ) -> Result<Self, SparseError> {
        let n = pattern.major_dim();
        assert_eq!(pattern.minor_dim(), n, "a square pattern");
        let column_pointers = widened(pattern.major_offsets());
        let row_indices = widened(pattern.minor_indices());
        let mut common = default_common();
        options.write_to(&mut common);
        // SAFETY: the arrays come from a square SparsityPattern: offsets increase from 0 to the number of entries, and
        // indices increase within a column and are in 0..n. KLU reads the arrays and does not keep them.
        let handle = unsafe {
            klu_l_analyze(
                n as i64,
                column_pointers.as_ptr().cast_mut(),
                row_indices.as_ptr().cast_mut(),
                &mut common,
            )
        };
        let handle = NonNull::new(handle).ok_or_else(|| error(&common, n))?;
        Ok(Self { handle, column_pointers, row_indices, options, factor_lock: Mutex::new(()) })
    }

    pub(crate) fn n(&self) -> usize {
        self.column_pointers.len() - 1
    }

    pub(crate) fn nnz(&self) -> usize {
        self.row_indices.len()
    }

    pub(super) fn ap(&self) -> *mut i64 {
        self.column_pointers.as_ptr().cast_mut()
    }

    pub(super) fn ai(&self) -> *mut i64 {
        self.row_indices.as_ptr().cast_mut()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, ()> {
        // The guarded data belong to KLU, whose C code cannot panic, so a poisoned lock is harmless.
        self.factor_lock.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for RawSymbolic {
    fn drop(&mut self) {
        let mut common = default_common();
        let mut handle = self.handle.as_ptr();
        // SAFETY: klu_l_analyze returned the handle, and it is freed only here.
        unsafe { klu_l_free_symbolic(&mut handle, &mut common) };
    }
}

/// Converts offsets or indices to the 64-bit integers of the C library.
fn widened(indices: &[usize]) -> Box<[i64]> {
    indices.iter().map(|&i| i as i64).collect()
}

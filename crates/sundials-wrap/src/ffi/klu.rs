//! KLU factorisations with 64-bit indices, real and complex.
//!
//! Life cycle: [`RawSymbolic`] (analysis of a pattern) → [`RawNumeric`] (factors of one matrix with
//! that pattern, refactored in place) → dropped in any order, the numeric object holding the
//! symbolic one alive.

use std::cell::UnsafeCell;
use std::ptr::{self, NonNull};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use num_complex::Complex64;
use suitesparse_sys::{
    KLU_OK, KLU_SINGULAR, klu_l_common, klu_l_condest, klu_l_defaults, klu_l_flops,
    klu_l_free_numeric, klu_l_free_symbolic, klu_l_numeric, klu_l_rcond, klu_l_refactor,
    klu_l_rgrowth, klu_l_solve, klu_l_symbolic, klu_l_tsolve, klu_zl_condest, klu_zl_flops,
    klu_zl_free_numeric, klu_zl_rcond, klu_zl_refactor, klu_zl_rgrowth, klu_zl_solve,
    klu_zl_tsolve,
};

// Declared in klu.h but left out of the bindings, whose filter of names misses functions that
// return a pointer to a structure.
unsafe extern "C" {
    fn klu_l_analyze(
        n: i64,
        column_pointers: *mut i64,
        row_indices: *mut i64,
        common: *mut klu_l_common,
    ) -> *mut klu_l_symbolic;
    fn klu_l_factor(
        column_pointers: *mut i64,
        row_indices: *mut i64,
        values: *mut f64,
        symbolic: *mut klu_l_symbolic,
        common: *mut klu_l_common,
    ) -> *mut klu_l_numeric;
    fn klu_zl_factor(
        column_pointers: *mut i64,
        row_indices: *mut i64,
        values: *mut f64,
        symbolic: *mut klu_l_symbolic,
        common: *mut klu_l_common,
    ) -> *mut klu_l_numeric;
}

/// KLU's Boolean "yes, it worked".
const TRUE: i64 = 1;

/// The settings of KLU that this crate exposes, in KLU's own coding.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawOptions {
    pub(crate) ordering: i64,
    pub(crate) btf: i64,
    pub(crate) scale: i64,
    pub(crate) pivot_tolerance: f64,
}

impl RawOptions {
    /// Writes the settings into a control block of KLU.
    pub(crate) fn write_to(self, common: &mut klu_l_common) {
        common.ordering = self.ordering;
        common.btf = self.btf;
        common.scale = self.scale;
        common.tol = self.pivot_tolerance;
    }
}

/// What KLU's control block says after a call that failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Failure {
    /// KLU's status code.
    pub(crate) status: i64,
    /// Column at which the matrix was found singular, −1 if none.
    pub(crate) singular_column: i64,
    /// Rank found so far, −1 if unknown.
    pub(crate) rank: i64,
}

impl Failure {
    fn of(common: &klu_l_common) -> Self {
        Self {
            status: common.status,
            singular_column: common.singular_col,
            rank: common.numerical_rank,
        }
    }

    /// Whether the matrix is singular (as opposed to lack of memory or a bad argument).
    pub(crate) fn is_singular(&self) -> bool {
        self.status == i64::from(KLU_SINGULAR)
    }
}

fn default_common() -> klu_l_common {
    let mut common = std::mem::MaybeUninit::<klu_l_common>::zeroed();
    // SAFETY: the pointer is to writable memory of the right size; klu_l_defaults only writes.
    unsafe { klu_l_defaults(common.as_mut_ptr()) };
    // SAFETY: all-zero bytes are a valid control block (numbers, null pointers, no function), and
    // klu_l_defaults has since set every parameter.
    unsafe { common.assume_init() }
}

/// The analysis of one pattern, with the pattern.
pub(crate) struct RawSymbolic {
    handle: NonNull<klu_l_symbolic>,
    column_pointers: Box<[i64]>,
    row_indices: Box<[i64]>,
    options: RawOptions,
    structural_rank: i64,
    /// klu_l_factor writes its revised size estimates into the symbolic object; all other
    /// functions only read parts that no function writes. Held during klu_l_factor.
    factor_lock: Mutex<()>,
}

// SAFETY: the handle is owned by this value and KLU keeps no thread-local state, so it may be used
// and freed from any thread.
unsafe impl Send for RawSymbolic {}
// SAFETY: the one KLU function that writes to the symbolic object (klu_l_factor) runs under
// `factor_lock`; it writes `Lnz`, which no other function called here reads.
unsafe impl Sync for RawSymbolic {}

impl RawSymbolic {
    /// Analyses a compressed-column pattern: `column_pointers` rises from 0 to
    /// `row_indices.len()`, the row indices of a column rise and lie in `0..n`.
    pub(crate) fn analyze(
        column_pointers: Box<[i64]>,
        row_indices: Box<[i64]>,
        options: RawOptions,
    ) -> Result<Self, Failure> {
        let mut common = default_common();
        options.write_to(&mut common);
        let n = column_pointers.len() as i64 - 1;
        // SAFETY: both arrays form a valid compressed-column pattern of order n (the caller's
        // promise); KLU reads them and does not keep them.
        let handle = unsafe {
            klu_l_analyze(
                n,
                column_pointers.as_ptr().cast_mut(),
                row_indices.as_ptr().cast_mut(),
                &mut common,
            )
        };
        let handle = NonNull::new(handle).ok_or_else(|| Failure::of(&common))?;
        Ok(Self {
            handle,
            column_pointers,
            row_indices,
            options,
            structural_rank: common.structural_rank,
            factor_lock: Mutex::new(()),
        })
    }

    pub(crate) fn n(&self) -> usize {
        self.column_pointers.len() - 1
    }

    pub(crate) fn nnz(&self) -> usize {
        self.row_indices.len()
    }

    /// Structural rank, −1 when BTF was off and it is not known.
    pub(crate) fn structural_rank(&self) -> i64 {
        self.structural_rank
    }

    /// The columns in the order of elimination.
    pub(crate) fn column_order(&self) -> Vec<usize> {
        // SAFETY: the analysis is ours and alive; nothing writes to it after klu_l_analyze.
        let order = unsafe { self.handle.as_ref() }.Q;
        // SAFETY: Q has one entry per column, written by klu_l_analyze, and lives with the handle.
        let order = unsafe { std::slice::from_raw_parts(order, self.n()) };
        order.iter().map(|&column| column as usize).collect()
    }

    fn ap(&self) -> *mut i64 {
        self.column_pointers.as_ptr().cast_mut()
    }

    fn ai(&self) -> *mut i64 {
        self.row_indices.as_ptr().cast_mut()
    }

    fn lock(&self) -> MutexGuard<'_, ()> {
        // The guarded data are KLU's, written by C code that cannot panic: poison means nothing.
        self.factor_lock
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for RawSymbolic {
    fn drop(&mut self) {
        let mut common = default_common();
        let mut handle = self.handle.as_ptr();
        // SAFETY: the handle came from klu_l_analyze and is freed here only.
        unsafe { klu_l_free_symbolic(&mut handle, &mut common) };
    }
}

type Factor = unsafe extern "C" fn(
    *mut i64,
    *mut i64,
    *mut f64,
    *mut klu_l_symbolic,
    *mut klu_l_common,
) -> *mut klu_l_numeric;
type Refactor = unsafe extern "C" fn(
    *mut i64,
    *mut i64,
    *mut f64,
    *mut klu_l_symbolic,
    *mut klu_l_numeric,
    *mut klu_l_common,
) -> i64;
type Solve = unsafe extern "C" fn(
    *mut klu_l_symbolic,
    *mut klu_l_numeric,
    i64,
    i64,
    *mut f64,
    *mut klu_l_common,
) -> i64;
type Free = unsafe extern "C" fn(*mut *mut klu_l_numeric, *mut klu_l_common) -> i64;
type Diagnose =
    unsafe extern "C" fn(*mut klu_l_symbolic, *mut klu_l_numeric, *mut klu_l_common) -> i64;
type Condest = unsafe extern "C" fn(
    *mut i64,
    *mut f64,
    *mut klu_l_symbolic,
    *mut klu_l_numeric,
    *mut klu_l_common,
) -> i64;

/// The family of KLU functions for one kind of number.
#[derive(Clone, Copy)]
pub struct Functions {
    factor: Factor,
    refactor: Refactor,
    solve: Solve,
    solve_transposed: Solve,
    free: Free,
    rcond: Diagnose,
    flops: Diagnose,
    condest: Condest,
    rgrowth: Refactor,
}

/// klu_zl_tsolve without its choice of conjugation: Aᵀ x = b, not Aᴴ x = b.
///
/// # Safety
/// As for klu_zl_tsolve.
unsafe extern "C" fn complex_tsolve(
    symbolic: *mut klu_l_symbolic,
    numeric: *mut klu_l_numeric,
    leading_dimension: i64,
    n_rhs: i64,
    rhs: *mut f64,
    common: *mut klu_l_common,
) -> i64 {
    // SAFETY: the caller's promise, passed on unchanged.
    unsafe { klu_zl_tsolve(symbolic, numeric, leading_dimension, n_rhs, rhs, 0, common) }
}

/// A number KLU can factorise with: `f64` or `Complex64`, laid out as one or two doubles.
///
/// # Safety
/// `FUNCTIONS` must be the family for matrices whose entries have the memory layout of `Self`.
pub unsafe trait Entry: Copy + 'static {
    /// The functions for matrices of this kind of number.
    const FUNCTIONS: Functions;
}

// SAFETY: klu_l_* take arrays of double.
unsafe impl Entry for f64 {
    const FUNCTIONS: Functions = Functions {
        factor: klu_l_factor,
        refactor: klu_l_refactor,
        solve: klu_l_solve,
        solve_transposed: klu_l_tsolve,
        free: klu_l_free_numeric,
        rcond: klu_l_rcond,
        flops: klu_l_flops,
        condest: klu_l_condest,
        rgrowth: klu_l_rgrowth,
    };
}

// SAFETY: klu_zl_* take interleaved real and imaginary parts; Complex64 is #[repr(C)] { re, im }.
unsafe impl Entry for Complex64 {
    const FUNCTIONS: Functions = Functions {
        factor: klu_zl_factor,
        refactor: klu_zl_refactor,
        solve: klu_zl_solve,
        solve_transposed: complex_tsolve,
        free: klu_zl_free_numeric,
        rcond: klu_zl_rcond,
        flops: klu_zl_flops,
        condest: klu_zl_condest,
        rgrowth: klu_zl_rgrowth,
    };
}

/// The LU factors of one matrix.
///
/// Not `Sync`: a solve uses workspace inside the numeric object.
pub(crate) struct RawNumeric<T: Entry> {
    handle: NonNull<klu_l_numeric>,
    symbolic: Arc<RawSymbolic>,
    common: UnsafeCell<klu_l_common>,
    entry: std::marker::PhantomData<T>,
}

// SAFETY: the handle and the control block are owned by this value; the symbolic object it shares
// is Sync. Nothing is bound to a thread.
unsafe impl<T: Entry> Send for RawNumeric<T> {}

impl<T: Entry> RawNumeric<T> {
    /// Factorises the matrix with the pattern of `symbolic` and these values.
    ///
    /// # Panics
    /// If `values` has not one entry per entry of the pattern.
    pub(crate) fn factor(symbolic: Arc<RawSymbolic>, values: &[T]) -> Result<Self, Failure> {
        assert_eq!(
            values.len(),
            symbolic.nnz(),
            "one value per entry of the pattern"
        );
        let mut common = default_common();
        symbolic.options.write_to(&mut common);
        let guard = symbolic.lock();
        // SAFETY: pattern and values have matching lengths; the symbolic object belongs to this
        // pattern and is locked against a concurrent factorisation; KLU reads the arrays only.
        let handle = unsafe {
            (T::FUNCTIONS.factor)(
                symbolic.ap(),
                symbolic.ai(),
                as_doubles(values),
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
            return Ok(Self {
                handle,
                symbolic,
                common,
                entry: std::marker::PhantomData,
            });
        }
        let failure = Failure::of(&common);
        if let Some(handle) = handle {
            let mut handle = handle.as_ptr();
            // SAFETY: the handle came from the factor function just now and is freed here only.
            unsafe { (T::FUNCTIONS.free)(&mut handle, &mut common) };
        }
        Err(failure)
    }

    /// Recomputes the factors for new values, keeping the pivots.
    ///
    /// # Panics
    /// If `values` has not one entry per entry of the pattern.
    pub(crate) fn refactor(&mut self, values: &[T]) -> Result<(), Failure> {
        self.with_matrix(T::FUNCTIONS.refactor, values)
    }

    /// Reciprocal pivot growth of the factors of the matrix with these values.
    ///
    /// # Panics
    /// If `values` has not one entry per entry of the pattern.
    pub(crate) fn rgrowth(&self, values: &[T]) -> Result<f64, Failure> {
        self.with_matrix(T::FUNCTIONS.rgrowth, values)?;
        Ok(self.common().rgrowth)
    }

    /// Estimate of the 1-norm condition number of the matrix with these values.
    ///
    /// # Panics
    /// If `values` has not one entry per entry of the pattern.
    pub(crate) fn condest(&self, values: &[T]) -> Result<f64, Failure> {
        assert_eq!(
            values.len(),
            self.symbolic.nnz(),
            "one value per entry of the pattern"
        );
        // SAFETY: pattern and values match, the handles belong together, KLU only reads them; the
        // control block is not borrowed elsewhere (`common` copies it out).
        let ok = unsafe {
            (T::FUNCTIONS.condest)(
                self.symbolic.ap(),
                as_doubles(values),
                self.symbolic.handle.as_ptr(),
                self.handle.as_ptr(),
                self.common.get(),
            )
        };
        self.check(ok)?;
        Ok(self.common().condest)
    }

    /// Cheap estimate of the reciprocal condition number: min |u_kk| / max |u_kk|.
    pub(crate) fn rcond(&self) -> Result<f64, Failure> {
        self.diagnose(T::FUNCTIONS.rcond)?;
        Ok(self.common().rcond)
    }

    /// Floating-point operations of a factorisation.
    pub(crate) fn flops(&self) -> Result<f64, Failure> {
        self.diagnose(T::FUNCTIONS.flops)?;
        Ok(self.common().flops)
    }

    /// Entries of L and of U, diagonals included.
    pub(crate) fn nnz_factors(&self) -> (usize, usize) {
        // SAFETY: the handle is valid for the life of self; two plain integers are read.
        let numeric = unsafe { self.handle.as_ref() };
        (numeric.lnz as usize, numeric.unz as usize)
    }

    /// Solves A x = b, or Aᵀ x = b, in place for the columns of `rhs`.
    ///
    /// # Panics
    /// If the length of `rhs` is not a multiple of the order of the matrix.
    pub(crate) fn solve(&self, rhs: &mut [T], transposed: bool) -> Result<(), Failure> {
        let n = self.symbolic.n();
        assert_eq!(rhs.len() % n, 0, "whole columns");
        let functions = T::FUNCTIONS;
        let solve = if transposed {
            functions.solve_transposed
        } else {
            functions.solve
        };
        // SAFETY: rhs holds whole columns of length n, laid out as KLU's numbers; the workspace
        // inside the numeric object is ours alone, since self is not Sync and KLU calls nothing
        // back; the control block is not borrowed elsewhere.
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

    fn with_matrix(&self, function: Refactor, values: &[T]) -> Result<(), Failure> {
        assert_eq!(
            values.len(),
            self.symbolic.nnz(),
            "one value per entry of the pattern"
        );
        // SAFETY: pattern and values match, the handles belong together; refactor, which writes
        // the numeric object, is reached through &mut self only, and no reference into it exists.
        let ok = unsafe {
            function(
                self.symbolic.ap(),
                self.symbolic.ai(),
                as_doubles(values),
                self.symbolic.handle.as_ptr(),
                self.handle.as_ptr(),
                self.common.get(),
            )
        };
        self.check(ok)
    }

    fn diagnose(&self, function: Diagnose) -> Result<(), Failure> {
        let (symbolic, numeric) = (self.symbolic.handle.as_ptr(), self.handle.as_ptr());
        // SAFETY: both handles are valid and belong together; the function reads them only.
        let ok = unsafe { function(symbolic, numeric, self.common.get()) };
        self.check(ok)
    }

    fn common(&self) -> klu_l_common {
        // SAFETY: KLU wrote the block before; self is not Sync, so nobody writes it now.
        unsafe { ptr::read(self.common.get()) }
    }

    fn check(&self, ok: i64) -> Result<(), Failure> {
        let common = self.common();
        if ok == TRUE && common.status == i64::from(KLU_OK) {
            Ok(())
        } else {
            Err(Failure::of(&common))
        }
    }
}

impl<T: Entry> Drop for RawNumeric<T> {
    fn drop(&mut self) {
        let mut handle = self.handle.as_ptr();
        // SAFETY: the handle came from the factor function of the same kind of number, is freed
        // here only, and the symbolic object (which the call needs not) is still alive.
        unsafe { (T::FUNCTIONS.free)(&mut handle, self.common.get_mut()) };
    }
}

fn as_doubles<T: Entry>(values: &[T]) -> *mut f64 {
    values.as_ptr().cast::<f64>().cast_mut()
}

//! Scalar types of KLU and the corresponding KLU functions.

use num_complex::Complex64;

use super::bindings::{
    klu_l_common, klu_l_factor, klu_l_free_numeric, klu_l_numeric, klu_l_rcond, klu_l_refactor,
    klu_l_rgrowth, klu_l_solve, klu_l_symbolic, klu_l_tsolve, klu_zl_factor, klu_zl_free_numeric,
    klu_zl_rcond, klu_zl_refactor, klu_zl_rgrowth, klu_zl_solve, klu_zl_tsolve,
};

pub(super) type Factor = unsafe extern "C" fn(
    *mut i64,
    *mut i64,
    *mut f64,
    *mut klu_l_symbolic,
    *mut klu_l_common,
) -> *mut klu_l_numeric;
pub(super) type Refactor = unsafe extern "C" fn(
    *mut i64,
    *mut i64,
    *mut f64,
    *mut klu_l_symbolic,
    *mut klu_l_numeric,
    *mut klu_l_common,
) -> i64;
pub(super) type Solve = unsafe extern "C" fn(
    *mut klu_l_symbolic,
    *mut klu_l_numeric,
    i64,
    i64,
    *mut f64,
    *mut klu_l_common,
) -> i64;
pub(super) type Free = unsafe extern "C" fn(*mut *mut klu_l_numeric, *mut klu_l_common) -> i64;
pub(super) type Diagnose =
    unsafe extern "C" fn(*mut klu_l_symbolic, *mut klu_l_numeric, *mut klu_l_common) -> i64;
/// The KLU functions for one scalar type.
#[derive(Clone, Copy)]
pub struct Functions {
    pub(super) factor: Factor,
    pub(super) refactor: Refactor,
    pub(super) solve: Solve,
    pub(super) solve_transposed: Solve,
    pub(super) free: Free,
    pub(super) rcond: Diagnose,
    pub(super) rgrowth: Refactor,
}

/// Calls klu_zl_tsolve without conjugation: Aᵀ x = b, not Aᴴ x = b.
///
/// # Safety
/// The conditions of klu_zl_tsolve apply.
unsafe extern "C" fn complex_tsolve(
    symbolic: *mut klu_l_symbolic,
    numeric: *mut klu_l_numeric,
    leading_dimension: i64,
    n_rhs: i64,
    rhs: *mut f64,
    common: *mut klu_l_common,
) -> i64 {
    // SAFETY: the caller guarantees the conditions; the arguments are passed on unchanged.
    unsafe { klu_zl_tsolve(symbolic, numeric, leading_dimension, n_rhs, rhs, 0, common) }
}

/// A scalar type of KLU: `f64` or `Complex64`, stored as one or two doubles.
///
/// # Safety
/// `FUNCTIONS` must be the functions for matrices whose entries have the memory layout of `Self`.
pub unsafe trait Entry: Copy + 'static {
    /// The KLU functions for this scalar type.
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
        rgrowth: klu_zl_rgrowth,
    };
}

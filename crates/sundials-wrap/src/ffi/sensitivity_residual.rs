//! Residuals of sensitivities and of sensitivities of quadratures, called by C.

use std::os::raw::{c_int, c_void};
use std::slice;

use sundials_sys::{N_Vector, realtype};

use super::callbacks::{Answer, Callbacks};
use super::trampoline::{Boundary, boundary, guarded, state};
use super::vector_view::zeroed_mut;

/// Calls a function with the vectors of each sensitivity in turn. Stops if a call fails.
///
/// # Safety
/// Must be called from a callback of IDAS. Each array contains `n` serial vectors of IDAS. IDAS does not access them
/// during the call.
unsafe fn each<C>(
    boundary: &mut Boundary<C>,
    n: c_int,
    [s, s_dot, outs]: [*mut N_Vector; 3],
    mut fill: impl FnMut(&mut C, usize, [&[f64]; 2], &mut [f64]) -> Answer,
) -> c_int {
    // SAFETY: the caller guarantees that each array contains n vectors.
    let [s, s_dot, outs] =
        [s, s_dot, outs].map(|v| unsafe { slice::from_raw_parts(v, n as usize) });
    let success = Answer::Success.code();
    for (j, &out) in outs.iter().enumerate() {
        // SAFETY: guaranteed by the caller.
        let (s, s_dot) = unsafe { state(s[j], s_dot[j]) };
        // SAFETY: the vector is valid but possibly uninitialized, and distinct from all others.
        let out = unsafe { zeroed_mut(out) };
        let code = guarded(boundary, |callbacks| fill(callbacks, j, [s, s_dot], out));
        if code != success {
            return code;
        }
    }
    success
}

/// Implements IDASensResFn.
///
/// # Safety
/// Must be called by IDAS with its serial vectors, `n` of them in each array, and with the address passed to
/// IDASetUserData.
pub(crate) unsafe extern "C" fn residual<C: Callbacks>(
    n: c_int,
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    _residual: N_Vector,
    s: *mut N_Vector,
    s_dot: *mut N_Vector,
    residuals: *mut N_Vector,
    user_data: *mut c_void,
    _scratch1: N_Vector,
    _scratch2: N_Vector,
    _scratch3: N_Vector,
) -> c_int {
    // SAFETY: IDAS passes back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialized, and IDAS does not access them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    let success = Answer::Success.code();
    let code = guarded(boundary, |callbacks| callbacks.linearize(t, y, y_dot));
    if code != success {
        return code;
    }
    // SAFETY: each array contains n vectors of IDAS.
    unsafe {
        each(boundary, n, [s, s_dot, residuals], |callbacks, j, of_j, out| {
            callbacks.sensitivity_residual(j, (t, y, y_dot), of_j, out)
        })
    }
}

/// Implements IDAQuadSensRhsFn.
///
/// # Safety
/// The conditions of [`residual`] apply.
pub(crate) unsafe extern "C" fn quadrature<C: Callbacks>(
    n: c_int,
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    s: *mut N_Vector,
    s_dot: *mut N_Vector,
    _rates: N_Vector,
    rates_of: *mut N_Vector,
    user_data: *mut c_void,
    _scratch1: N_Vector,
    _scratch2: N_Vector,
    _scratch3: N_Vector,
) -> c_int {
    // SAFETY: IDAS passes back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialized, and IDAS does not access them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    // SAFETY: each array contains n vectors of IDAS.
    unsafe {
        each(boundary, n, [s, s_dot, rates_of], |callbacks, j, of_j, out| {
            callbacks.quadrature_sensitivity(j, (t, y, y_dot), of_j, out)
        })
    }
}

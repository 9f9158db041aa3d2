//! C callbacks of backward problems, as in [`trampoline`](super::trampoline) for the forward
//! problem.
//!
//! During a backward integration IDAS also calls the functions of the forward problem, to repeat
//! its steps from a checkpoint. The two kinds of calls alternate and do not nest.

use std::os::raw::{c_int, c_void};
use std::ptr::NonNull;
use std::slice;

use sundials_sys::{N_Vector, SUNLinearSolver, SUNMatrix, realtype};

use super::callbacks::{Callbacks, ForwardView};
use super::trampoline::{Boundary, boundary, guarded, solved, state};
use super::vector_view::zeroed_mut;

/// User data of one backward problem.
pub(crate) struct Link<C> {
    pub(crate) boundary: NonNull<Boundary<C>>,
    pub(crate) which: usize,
    /// Length of the arrays of sensitivities.
    pub(crate) n_parameters: usize,
}

/// Returns the index of a backward problem, the number of its parameters, and the user data of its solver.
///
/// # Safety
/// `user_data` is the address of a live `Link<C>`; its `Boundary` satisfies the conditions of [`boundary`].
unsafe fn linked<'a, C>(user_data: *mut c_void) -> (usize, usize, &'a mut Boundary<C>) {
    // SAFETY: the caller's promise; links are not written to.
    let link = unsafe { &*user_data.cast::<Link<C>>() };
    // SAFETY: the caller's promise.
    let boundary = unsafe { boundary::<C>(link.boundary.as_ptr().cast()) };
    (link.which, link.n_parameters, boundary)
}

/// Returns the forward solution passed by IDAS.
///
/// # Safety
/// All vectors are serial, initialized and not written to during `'a`; both arrays hold `n` of
/// them, or are not read for `n` = 0.
unsafe fn forward<'a>(
    t: f64,
    [y, y_dot]: [N_Vector; 2],
    [s, s_dot]: [*mut N_Vector; 2],
    n: usize,
) -> ForwardView<'a> {
    // SAFETY: the caller's promise.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    if n == 0 {
        let s = Vec::new();
        return ForwardView { t, y, y_dot, s };
    }
    // SAFETY: n vectors, the caller's promise.
    let s = unsafe { slice::from_raw_parts(s, n) };
    // SAFETY: as above.
    let s_dot = unsafe { slice::from_raw_parts(s_dot, n) };
    let pair = |(&s, &s_dot)| {
        // SAFETY: the caller's promise.
        let (s, s_dot) = unsafe { state(s, s_dot) };
        [s, s_dot]
    };
    let s = s.iter().zip(s_dot).map(pair).collect();
    ForwardView { t, y, y_dot, s }
}

/// Arguments of a callback: the index of the backward problem, the user data of the solver, the forward solution, and λ
/// with λ̇.
type Handed<'a, C> = (usize, &'a mut Boundary<C>, ForwardView<'a>, [&'a [f64]; 2]);

/// Converts the arguments that C passes to a callback.
///
/// # Safety
/// As for [`linked`] and [`forward`], with as many sensitivities as the link states.
unsafe fn handed<'a, C>(
    user_data: *mut c_void,
    t: f64,
    solution: [N_Vector; 2],
    sensitivities: [*mut N_Vector; 2],
    [values, rates]: [N_Vector; 2],
) -> Handed<'a, C> {
    // SAFETY: the caller's promise.
    let (which, n, boundary) = unsafe { linked::<C>(user_data) };
    // SAFETY: the caller's promise.
    let forward = unsafe { forward(t, solution, sensitivities, n) };
    // SAFETY: the caller's promise.
    let (values, rates) = unsafe { state(values, rates) };
    (which, boundary, forward, [values, rates])
}

/// Neither S nor Ṡ.
const NONE: *mut N_Vector = std::ptr::null_mut();

/// Implements IDAResFnBS.
///
/// # Safety
/// Must be called by IDAS with its serial vectors and the address of a live `Link<C>`. The arrays of sensitivities have
/// as many entries as the link states.
pub(crate) unsafe extern "C" fn residual_with<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    s: *mut N_Vector,
    s_dot: *mut N_Vector,
    values: N_Vector,
    rates: N_Vector,
    residual: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS hands back the address of our link and does not touch its vectors during the call;
    // callbacks do not nest.
    let (which, boundary, forward, values) =
        unsafe { handed::<C>(user_data, t, [y, y_dot], [s, s_dot], [values, rates]) };
    // SAFETY: as above, but possibly fresh; distinct from all others.
    let residual = unsafe { zeroed_mut(residual) };
    guarded(boundary, |callbacks| callbacks.backward_residual(which, &forward, values, residual))
}

/// Implements IDAResFnB.
///
/// # Safety
/// As for [`residual_with`], for a link without parameters.
pub(crate) unsafe extern "C" fn residual<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    values: N_Vector,
    rates: N_Vector,
    residual: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: the caller's promise.
    unsafe { residual_with::<C>(t, y, y_dot, NONE, NONE, values, rates, residual, user_data) }
}

/// Implements IDALsJacFnBS.
///
/// # Safety
/// As for [`residual_with`]; the matrix is not used.
pub(crate) unsafe extern "C" fn setup_with<C: Callbacks>(
    t: realtype,
    c_j: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    s: *mut N_Vector,
    s_dot: *mut N_Vector,
    values: N_Vector,
    rates: N_Vector,
    _residual: N_Vector,
    _matrix: SUNMatrix,
    user_data: *mut c_void,
    _scratch1: N_Vector,
    _scratch2: N_Vector,
    _scratch3: N_Vector,
) -> c_int {
    // SAFETY: IDAS hands back the address of our link and does not touch its vectors during the call;
    // callbacks do not nest.
    let (which, boundary, forward, values) =
        unsafe { handed::<C>(user_data, t, [y, y_dot], [s, s_dot], [values, rates]) };
    guarded(boundary, |callbacks| callbacks.backward_setup(which, &forward, values, c_j))
}

/// Implements IDALsJacFnB.
///
/// # Safety
/// As for [`setup_with`], for a link without parameters.
pub(crate) unsafe extern "C" fn setup<C: Callbacks>(
    t: realtype,
    c_j: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    values: N_Vector,
    rates: N_Vector,
    residual: N_Vector,
    matrix: SUNMatrix,
    user_data: *mut c_void,
    scratch1: N_Vector,
    scratch2: N_Vector,
    scratch3: N_Vector,
) -> c_int {
    // SAFETY: the caller's promise.
    unsafe {
        setup_with::<C>(
            t, c_j, y, y_dot, NONE, NONE, values, rates, residual, matrix, user_data, scratch1,
            scratch2, scratch3,
        )
    }
}

/// Implements the solve operation of the linear solver.
///
/// # Safety
/// Must be called by IDAS with a linear solver whose content is the link of this crate, and serial
/// vectors.
pub(crate) unsafe extern "C" fn solve<C: Callbacks>(
    solver: SUNLinearSolver,
    _matrix: SUNMatrix,
    x: N_Vector,
    b: N_Vector,
    _tolerance: realtype,
) -> c_int {
    // SAFETY: the solver is ours and alive.
    let user_data = unsafe { (*solver).content };
    // SAFETY: its content is the address of our link, and callbacks do not nest.
    let (which, _, boundary) = unsafe { linked::<C>(user_data) };
    // SAFETY: x and b are what IDAS handed over.
    unsafe { solved(boundary, x, b, |callbacks, rhs| callbacks.backward_solve(which, rhs)) }
}

/// Implements IDAQuadRhsFnBS.
///
/// # Safety
/// As for [`residual_with`].
pub(crate) unsafe extern "C" fn quadrature_with<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    s: *mut N_Vector,
    s_dot: *mut N_Vector,
    values: N_Vector,
    rates: N_Vector,
    out: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS hands back the address of our link and does not touch its vectors during the call;
    // callbacks do not nest.
    let (which, boundary, forward, values) =
        unsafe { handed::<C>(user_data, t, [y, y_dot], [s, s_dot], [values, rates]) };
    // SAFETY: as above, but possibly fresh; distinct from all others.
    let out = unsafe { zeroed_mut(out) };
    guarded(boundary, |callbacks| callbacks.backward_quadrature(which, &forward, values, out))
}

/// Implements IDAQuadRhsFnB.
///
/// # Safety
/// As for [`quadrature_with`], for a link without parameters.
pub(crate) unsafe extern "C" fn quadrature<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    values: N_Vector,
    rates: N_Vector,
    out: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: the caller's promise.
    unsafe { quadrature_with::<C>(t, y, y_dot, NONE, NONE, values, rates, out, user_data) }
}

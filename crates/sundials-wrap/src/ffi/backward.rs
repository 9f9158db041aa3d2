//! C callbacks of backward problems, similar to the callbacks of the forward problem in [`trampoline`](super::trampoline).
//!
//! During a backward integration, IDAS also calls the functions of the forward problem in order to repeat its steps
//! from a checkpoint. Forward and backward calls alternate and are not nested.

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
    /// Number of vectors in the arrays of sensitivities.
    pub(crate) n_parameters: usize,
}

/// Returns the index of a backward problem, the number of parameters, and the user data of its solver.
///
/// # Safety
/// `user_data` is the address of a live `Link<C>`; its `Boundary` satisfies the conditions of [`boundary`].
unsafe fn linked<'a, C>(user_data: *mut c_void) -> (usize, usize, &'a mut Boundary<C>) {
    // SAFETY: guaranteed by the caller; nothing writes to links.
    let link = unsafe { &*user_data.cast::<Link<C>>() };
    // SAFETY: guaranteed by the caller.
    let boundary = unsafe { boundary::<C>(link.boundary.as_ptr().cast()) };
    (link.which, link.n_parameters, boundary)
}

/// Returns the forward solution passed by IDAS.
///
/// # Safety
/// All vectors are serial and initialized, and nothing writes to them during `'a`. Both arrays contain `n` vectors;
/// they are not read if `n` = 0.
unsafe fn forward<'a>(
    t: f64,
    [y, y_dot]: [N_Vector; 2],
    [s, s_dot]: [*mut N_Vector; 2],
    n: usize,
) -> ForwardView<'a> {
    // SAFETY: guaranteed by the caller.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    if n == 0 {
        let s = Vec::new();
        return ForwardView { t, y, y_dot, s };
    }
    // SAFETY: the caller guarantees that the array contains n vectors.
    let s = unsafe { slice::from_raw_parts(s, n) };
    // SAFETY: as above.
    let s_dot = unsafe { slice::from_raw_parts(s_dot, n) };
    let pair = |(&s, &s_dot)| {
        // SAFETY: guaranteed by the caller.
        let (s, s_dot) = unsafe { state(s, s_dot) };
        [s, s_dot]
    };
    let s = s.iter().zip(s_dot).map(pair).collect();
    ForwardView { t, y, y_dot, s }
}

/// Arguments of a callback: the index of the backward problem, the user data of the solver, the forward solution, and λ
/// with λ̇.
type Handed<'a, C> = (usize, &'a mut Boundary<C>, ForwardView<'a>, [&'a [f64]; 2]);

/// Converts the arguments of a callback from C.
///
/// # Safety
/// The conditions of [`linked`] and [`forward`] apply. The number of sensitivities is the number stated by the link.
unsafe fn handed<'a, C>(
    user_data: *mut c_void,
    t: f64,
    solution: [N_Vector; 2],
    sensitivities: [*mut N_Vector; 2],
    [values, rates]: [N_Vector; 2],
) -> Handed<'a, C> {
    // SAFETY: guaranteed by the caller.
    let (which, n, boundary) = unsafe { linked::<C>(user_data) };
    // SAFETY: guaranteed by the caller.
    let forward = unsafe { forward(t, solution, sensitivities, n) };
    // SAFETY: guaranteed by the caller.
    let (values, rates) = unsafe { state(values, rates) };
    (which, boundary, forward, [values, rates])
}

/// Null pointer instead of S or Ṡ.
const NONE: *mut N_Vector = std::ptr::null_mut();

/// Implements IDAResFnBS or IDAQuadRhsFnBS.
///
/// # Safety
/// Must be called by IDAS with its serial vectors and the address of a live `Link<C>`. Each array of sensitivities has
/// as many entries as the link states.
pub(crate) unsafe extern "C" fn evaluate_with<C: Callbacks, const IS_QUADRATURE: bool>(
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
    // SAFETY: IDAS passes back the address of our link and does not access its vectors during the call; callbacks are
    // not nested.
    let (which, boundary, forward, values) =
        unsafe { handed::<C>(user_data, t, [y, y_dot], [s, s_dot], [values, rates]) };
    // SAFETY: the vector is valid but possibly uninitialized, and distinct from all others.
    let out = unsafe { zeroed_mut(out) };
    guarded(boundary, |callbacks| match IS_QUADRATURE {
        false => callbacks.backward_residual(which, &forward, values, out),
        true => callbacks.backward_quadrature(which, &forward, values, out),
    })
}

/// Implements IDAResFnB or IDAQuadRhsFnB.
///
/// # Safety
/// The conditions of [`evaluate_with`] apply; the link has no parameters.
pub(crate) unsafe extern "C" fn evaluate<C: Callbacks, const IS_QUADRATURE: bool>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    values: N_Vector,
    rates: N_Vector,
    out: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: guaranteed by the caller.
    unsafe {
        evaluate_with::<C, IS_QUADRATURE>(t, y, y_dot, NONE, NONE, values, rates, out, user_data)
    }
}

/// Implements IDALsJacFnBS.
///
/// # Safety
/// The conditions of [`evaluate_with`] apply; the matrix is not used.
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
    // SAFETY: IDAS passes back the address of our link and does not access its vectors during the call; callbacks are
    // not nested.
    let (which, boundary, forward, values) =
        unsafe { handed::<C>(user_data, t, [y, y_dot], [s, s_dot], [values, rates]) };
    guarded(boundary, |callbacks| callbacks.backward_setup(which, &forward, values, c_j))
}

/// Implements IDALsJacFnB.
///
/// # Safety
/// The conditions of [`setup_with`] apply; the link has no parameters.
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
    // SAFETY: guaranteed by the caller.
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
/// Must be called by IDAS with serial vectors and a linear solver whose content is a link of this crate.
pub(crate) unsafe extern "C" fn solve<C: Callbacks>(
    solver: SUNLinearSolver,
    _matrix: SUNMatrix,
    x: N_Vector,
    b: N_Vector,
    _tolerance: realtype,
) -> c_int {
    // SAFETY: this crate created the solver, which is alive.
    let user_data = unsafe { (*solver).content };
    // SAFETY: its content is the address of our link, and callbacks are not nested.
    let (which, _, boundary) = unsafe { linked::<C>(user_data) };
    // SAFETY: x and b are the vectors passed by IDAS.
    unsafe { solved(boundary, x, b, |callbacks, rhs| callbacks.backward_solve(which, rhs)) }
}

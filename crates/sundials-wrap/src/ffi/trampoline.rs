//! C callbacks. Each function converts pointers to slices, calls one method of [`Callbacks`], catches a panic, and
//! converts the result to a return code of IDAS.

use std::any::Any;
use std::os::raw::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::slice;

use sundials_sys::{N_Vector, SUNLS_PACKAGE_FAIL_REC, SUNLinearSolver, SUNMatrix, realtype};

use super::callbacks::{Answer, Callbacks};
use super::vector_view::{view, view_mut, zeroed_mut};
use super::version;

/// User data passed to C: the callbacks, and a panic that was caught.
pub(crate) struct Boundary<C> {
    pub(crate) callbacks: C,
    /// Panic to be resumed after C returns.
    pub(crate) panic: Option<Box<dyn Any + Send>>,
}

impl<C> Boundary<C> {
    pub(crate) fn new(callbacks: C) -> Self {
        Self { callbacks, panic: None }
    }
}

/// Returns the user data at the address passed back by C.
///
/// # Safety
/// `user_data` is the address of a live [`Pinned`](super::pinned::Pinned) `Boundary<C>` to which no reference exists
/// during `'a`. IDAS calls back only inside calls with `&mut Ida`. Callbacks are not nested, since they
/// cannot access the integrator.
pub(super) unsafe fn boundary<'a, C>(user_data: *mut c_void) -> &'a mut Boundary<C> {
    // SAFETY: guaranteed by the caller.
    unsafe { &mut *user_data.cast::<Boundary<C>>() }
}

/// Returns y and ẏ as passed by IDAS.
///
/// # Safety
/// The conditions of [`view`] apply to both vectors.
pub(super) unsafe fn state<'a>(y: N_Vector, y_dot: N_Vector) -> (&'a [f64], &'a [f64]) {
    // SAFETY: guaranteed by the caller.
    let y = unsafe { view(y) };
    // SAFETY: guaranteed by the caller.
    (y, unsafe { view(y_dot) })
}

/// Runs a callback. A panic is stored and reported to C as a fatal error.
pub(super) fn guarded<C>(
    boundary: &mut Boundary<C>,
    callback: impl FnOnce(&mut C) -> Answer,
) -> c_int {
    guarded_or(boundary, Answer::Fatal, callback).code()
}

/// Runs a callback. If it panics, stores the panic and returns `fatal`.
pub(super) fn guarded_or<C, T>(
    boundary: &mut Boundary<C>,
    fatal: T,
    callback: impl FnOnce(&mut C) -> T,
) -> T {
    let callbacks = &mut boundary.callbacks;
    // Unwind safety: the solver becomes accessible only when the panic is resumed.
    match catch_unwind(AssertUnwindSafe(|| callback(callbacks))) {
        Ok(answer) => answer,
        Err(panic) => {
            boundary.panic = Some(panic);
            fatal
        }
    }
}

/// Implements IDAResFn or IDAQuadRhsFn.
///
/// # Safety
/// Must be called by IDAS with its serial vectors and the address passed to IDASetUserData.
pub(crate) unsafe extern "C" fn evaluate<C: Callbacks, const IS_QUADRATURE: bool>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    out: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS passes back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialized, and IDAS does not access them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    // SAFETY: the vector is valid but possibly uninitialized, and distinct from y and ẏ.
    let out = unsafe { zeroed_mut(out) };
    guarded(boundary, |callbacks| match IS_QUADRATURE {
        false => callbacks.residual(t, y, y_dot, out),
        true => callbacks.quadrature(t, y, y_dot, out),
    })
}

/// Implements IDALsJacFn: the setup of the linear solver, which stores its matrix internally.
///
/// # Safety
/// The conditions of [`evaluate`] apply; the matrix is not used.
pub(crate) unsafe extern "C" fn linear_setup<C: Callbacks>(
    t: realtype,
    c_j: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    _residual: N_Vector,
    _matrix: SUNMatrix,
    user_data: *mut c_void,
    _scratch1: N_Vector,
    _scratch2: N_Vector,
    _scratch3: N_Vector,
) -> c_int {
    // SAFETY: IDAS passes back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialized, and IDAS does not access them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    guarded(boundary, |callbacks| callbacks.linear_setup(t, y, y_dot, c_j))
}

/// Implements the solve operation of the linear solver.
///
/// # Safety
/// Must be called by IDAS with a [`LinearSolver`] of this crate and serial vectors.
///
/// [`LinearSolver`]: super::linear_solver::LinearSolver
pub(crate) unsafe extern "C" fn linear_solve<C: Callbacks>(
    solver: SUNLinearSolver,
    _matrix: SUNMatrix,
    x: N_Vector,
    b: N_Vector,
    _tolerance: realtype,
) -> c_int {
    // SAFETY: this crate created the solver, which is alive.
    let user_data = unsafe { (*solver).content };
    // SAFETY: its content is the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: x and b are the vectors passed by IDAS.
    unsafe { solved(boundary, x, b, Callbacks::linear_solve) }
}

/// Copies the right-hand side b to x and calls `solve`, which works in place.
///
/// # Safety
/// Both are serial vectors of the same length, b is initialized, and C does not access them during the call.
pub(super) unsafe fn solved<C>(
    boundary: &mut Boundary<C>,
    x: N_Vector,
    b: N_Vector,
    solve: impl FnOnce(&mut C, &mut [f64]) -> Answer,
) -> c_int {
    // SAFETY: guaranteed by the caller.
    let b = unsafe { view(b) };
    // SAFETY: as above; the x passed by IDAS is distinct from b.
    let x = unsafe { view_mut(x) };
    x.copy_from_slice(b);
    // IDAS treats unknown codes of linear solvers as success.
    match guarded_or(boundary, Answer::Fatal, |callbacks| solve(callbacks, x)) {
        Answer::Success => 0,
        Answer::Recoverable => SUNLS_PACKAGE_FAIL_REC as c_int,
        Answer::Fatal => version::SOLVE_FAILED,
    }
}

/// Implements IDARootFn.
///
/// # Safety
/// The conditions of [`evaluate`] apply. `values` has space for the number of values passed to IDARootInit.
pub(crate) unsafe extern "C" fn roots<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    values: *mut realtype,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS passes back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialized, and IDAS does not access them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    let n_roots = boundary.callbacks.n_roots();
    // SAFETY: IDAS allocated n_roots numbers, as passed to IDARootInit; this call initializes them.
    unsafe { values.write_bytes(0, n_roots) };
    // SAFETY: as above, and IDAS does not access them during the call.
    let values = unsafe { slice::from_raw_parts_mut(values, n_roots) };
    guarded(boundary, |callbacks| callbacks.roots(t, y, y_dot, values))
}

/// Implements IDAEwtFn.
///
/// # Safety
/// The conditions of [`evaluate`] apply.
pub(crate) unsafe extern "C" fn error_weights<C: Callbacks>(
    y: N_Vector,
    weights: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS passes back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialized, and IDAS does not access them during the call.
    let y = unsafe { view(y) };
    // SAFETY: the vector is valid but possibly uninitialized, and distinct from y.
    let weights = unsafe { zeroed_mut(weights) };
    guarded(boundary, |callbacks| callbacks.error_weights(y, weights))
}

//! What C calls: each function turns pointers into slices, calls one method of [`Callbacks`],
//! catches its panic, and turns the answer into IDAS' code.
//!
//! Codes: 0 success, +1 recoverable (IDAS may try a smaller step), −1 unrecoverable.

use std::any::Any;
use std::ffi::CStr;
use std::os::raw::{c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::NonNull;
use std::slice;

use suitesparse_sys::klu_l_common;
use sundials_sys::{
    N_Vector, SUNLS_PACKAGE_FAIL_REC, SUNLS_PACKAGE_FAIL_UNREC, SUNLinearSolver, SUNMatrix,
    realtype,
};

use super::matrix::zeroed_values;
use super::vector_view::{view, view_mut, zeroed_mut};

/// What a callback answers to IDAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Go on.
    Success,
    /// Try again with a smaller step.
    Recoverable,
    /// Stop.
    Fatal,
}

impl Answer {
    fn code(self) -> c_int {
        match self {
            Self::Success => 0,
            Self::Recoverable => 1,
            Self::Fatal => -1,
        }
    }
}

/// The safe side of the boundary: what IDAS may ask.
pub(crate) trait Callbacks {
    fn residual(&mut self, t: f64, y: &[f64], y_dot: &[f64], residual: &mut [f64]) -> Answer;
    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        c_j: f64,
        values: &mut [f64],
    ) -> Answer;
    fn structured_setup(&mut self, t: f64, y: &[f64], y_dot: &[f64], c_j: f64) -> Answer;
    fn structured_solve(&mut self, rhs: &mut [f64]) -> Answer;
    fn n_roots(&self) -> usize;
    fn roots(&mut self, t: f64, y: &[f64], y_dot: &[f64], values: &mut [f64]) -> Answer;
    fn error_weights(&mut self, y: &[f64], weights: &mut [f64]) -> Answer;
    fn quadrature(&mut self, t: f64, y: &[f64], y_dot: &[f64], rates: &mut [f64]) -> Answer;
    /// Takes a message of IDAS.
    fn message(&mut self, text: &str);
}

/// What C holds a pointer to: the callbacks, and what must be remembered across the boundary.
pub(crate) struct Boundary<C> {
    pub(crate) callbacks: C,
    /// A panic on its way through C.
    pub(crate) panic: Option<Box<dyn Any + Send>>,
    /// KLU's control block, once the linear solver exists; it outlives the integrator.
    common: Option<NonNull<klu_l_common>>,
    /// Smallest reciprocal condition number KLU estimated, of those seen so far.
    smallest_rcond: Option<f64>,
}

impl<C> Boundary<C> {
    pub(crate) fn new(callbacks: C) -> Self {
        Self {
            callbacks,
            panic: None,
            common: None,
            smallest_rcond: None,
        }
    }

    /// Reads condition estimates from now on from the control block of a linear solver that lives
    /// as long as calls are made through this boundary.
    pub(super) fn watch_rcond(&mut self, common: Option<NonNull<klu_l_common>>) {
        self.common = common;
    }

    /// Starts the search for the smallest condition estimate afresh.
    pub(super) fn forget_rcond(&mut self) {
        self.smallest_rcond = None;
    }

    /// The smallest of the condition estimates noted and `last`, that of the last set-up.
    pub(super) fn smallest_rcond(&self, last: Option<f64>) -> Option<f64> {
        // KLU says −1 before the first estimate.
        let last = last.filter(|&rcond| rcond >= 0.0);
        [self.smallest_rcond, last]
            .into_iter()
            .flatten()
            .reduce(f64::min)
    }

    /// Notes the condition estimate of the last set-up, before the next one overwrites it.
    fn note_rcond(&mut self) {
        // SAFETY: the linear solver, which holds the block, is alive while IDAS runs; nobody
        // writes to the block during a callback.
        let last = self.common.map(|common| unsafe { common.read() }.rcond);
        self.smallest_rcond = self.smallest_rcond(last);
    }
}

/// The boundary behind a pointer that C hands back.
///
/// # Safety
/// `user_data` is the address of a live [`Pinned`](super::pinned::Pinned) `Boundary<C>` to which
/// no reference exists during `'a`. IDAS calls back only inside calls made with `&mut Ida`, and
/// callbacks do not nest, since none of them can reach the integrator.
unsafe fn boundary<'a, C>(user_data: *mut c_void) -> &'a mut Boundary<C> {
    // SAFETY: the caller's promise.
    unsafe { &mut *user_data.cast::<Boundary<C>>() }
}

/// y and ẏ as IDAS hands them over.
///
/// # Safety
/// As for [`view`], of both.
unsafe fn state<'a>(y: N_Vector, y_dot: N_Vector) -> (&'a [f64], &'a [f64]) {
    // SAFETY: the caller's promise.
    let y = unsafe { view(y) };
    // SAFETY: the caller's promise.
    (y, unsafe { view(y_dot) })
}

/// Runs a callback; a panic is kept for later and answered as fatal.
fn guarded<C>(boundary: &mut Boundary<C>, callback: impl FnOnce(&mut C) -> Answer) -> c_int {
    answered(boundary, callback).code()
}

fn answered<C>(boundary: &mut Boundary<C>, callback: impl FnOnce(&mut C) -> Answer) -> Answer {
    let callbacks = &mut boundary.callbacks;
    // Unwind safety: the solver is handed back only together with the resumed panic.
    match catch_unwind(AssertUnwindSafe(|| callback(callbacks))) {
        Ok(answer) => answer,
        Err(panic) => {
            boundary.panic = Some(panic);
            Answer::Fatal
        }
    }
}

/// IDAResFn.
///
/// # Safety
/// Called by IDAS with its own serial vectors and the address given to IDASetUserData.
pub(crate) unsafe extern "C" fn residual<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    residual: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS hands back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialised; it does not touch them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    // SAFETY: as above, but possibly fresh; distinct from y and ẏ.
    let residual = unsafe { zeroed_mut(residual) };
    guarded(boundary, |callbacks| {
        callbacks.residual(t, y, y_dot, residual)
    })
}

/// IDALsJacFn with a sparse matrix.
///
/// # Safety
/// Called by IDAS with its own serial vectors, the matrix of [`Matrix::sparse`] and the address
/// given to IDASetUserData.
///
/// [`Matrix::sparse`]: super::matrix::Matrix::sparse
pub(crate) unsafe extern "C" fn jacobian<C: Callbacks>(
    t: realtype,
    c_j: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    _residual: N_Vector,
    matrix: SUNMatrix,
    user_data: *mut c_void,
    _scratch1: N_Vector,
    _scratch2: N_Vector,
    _scratch3: N_Vector,
) -> c_int {
    // SAFETY: IDAS hands back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    boundary.note_rcond();
    // SAFETY: IDAS' vectors are serial and initialised; it does not touch them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    // SAFETY: the matrix is the sparse one attached together with this function.
    let values = unsafe { zeroed_values(matrix) };
    guarded(boundary, |callbacks| {
        callbacks.jacobian(t, y, y_dot, c_j, values)
    })
}

/// IDALsJacFn for a solver that keeps its matrix to itself.
///
/// # Safety
/// As for [`residual`]; the matrix is not used.
pub(crate) unsafe extern "C" fn structured_setup<C: Callbacks>(
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
    // SAFETY: IDAS hands back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialised; it does not touch them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    guarded(boundary, |callbacks| {
        callbacks.structured_setup(t, y, y_dot, c_j)
    })
}

/// The solve operation of a user's linear solver.
///
/// # Safety
/// Called by IDAS with the solver of [`LinearSolver::structured`] and serial vectors.
///
/// [`LinearSolver::structured`]: super::linear_solver::LinearSolver::structured
pub(crate) unsafe extern "C" fn structured_solve<C: Callbacks>(
    solver: SUNLinearSolver,
    _matrix: SUNMatrix,
    x: N_Vector,
    b: N_Vector,
    _tolerance: realtype,
) -> c_int {
    // SAFETY: the solver is ours and alive.
    let user_data = unsafe { (*solver).content };
    // SAFETY: its content is the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialised; it does not touch them during the call.
    let b = unsafe { view(b) };
    // SAFETY: as above; IDAS solves from b into an x of its own.
    let x = unsafe { view_mut(x) };
    x.copy_from_slice(b);
    // IDAS takes codes that are not among those of linear solvers for success.
    match answered(boundary, |callbacks| callbacks.structured_solve(x)) {
        Answer::Success => 0,
        Answer::Recoverable => SUNLS_PACKAGE_FAIL_REC as c_int,
        Answer::Fatal => SUNLS_PACKAGE_FAIL_UNREC,
    }
}

/// IDARootFn.
///
/// # Safety
/// As for [`residual`]; `values` has room for as many numbers as IDARootInit was told.
pub(crate) unsafe extern "C" fn roots<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    values: *mut realtype,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS hands back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialised; it does not touch them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    let n_roots = boundary.callbacks.n_roots();
    // SAFETY: IDAS allocated n_roots numbers, as IDARootInit was told; this initialises them.
    unsafe { values.write_bytes(0, n_roots) };
    // SAFETY: as above, and IDAS does not touch them during the call.
    let values = unsafe { slice::from_raw_parts_mut(values, n_roots) };
    guarded(boundary, |callbacks| callbacks.roots(t, y, y_dot, values))
}

/// IDAEwtFn.
///
/// # Safety
/// As for [`residual`].
pub(crate) unsafe extern "C" fn error_weights<C: Callbacks>(
    y: N_Vector,
    weights: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS hands back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialised; it does not touch them during the call.
    let y = unsafe { view(y) };
    // SAFETY: as above, but possibly fresh; distinct from y.
    let weights = unsafe { zeroed_mut(weights) };
    guarded(boundary, |callbacks| callbacks.error_weights(y, weights))
}

/// IDAQuadRhsFn.
///
/// # Safety
/// As for [`residual`].
pub(crate) unsafe extern "C" fn quadrature<C: Callbacks>(
    t: realtype,
    y: N_Vector,
    y_dot: N_Vector,
    rates: N_Vector,
    user_data: *mut c_void,
) -> c_int {
    // SAFETY: IDAS hands back the address of our boundary, and callbacks do not nest.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS' vectors are serial and initialised; it does not touch them during the call.
    let (y, y_dot) = unsafe { state(y, y_dot) };
    // SAFETY: as above, but possibly fresh; distinct from y and ẏ.
    let rates = unsafe { zeroed_mut(rates) };
    guarded(boundary, |callbacks| {
        callbacks.quadrature(t, y, y_dot, rates)
    })
}

/// IDAErrHandlerFn: keeps the message instead of printing it.
///
/// # Safety
/// Called by IDAS with zero-terminated strings and the address given to IDASetErrHandlerFn, while
/// no callback runs.
pub(crate) unsafe extern "C" fn message<C: Callbacks>(
    _code: c_int,
    _module: *const c_char,
    _function: *const c_char,
    text: *mut c_char,
    user_data: *mut c_void,
) {
    // SAFETY: IDAS hands back the address of our boundary, and reports between callbacks.
    let boundary = unsafe { boundary::<C>(user_data) };
    // SAFETY: IDAS passes a zero-terminated string that lives during the call.
    let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
    boundary.callbacks.message(&text);
}

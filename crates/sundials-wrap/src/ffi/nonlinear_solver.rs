//! Newton's method of SUNDIALS with the convergence test of this crate.

use std::os::raw::{c_int, c_void};
use std::ptr::NonNull;

use sundials_sys as sys;
use sundials_sys::{N_Vector, SUNNonlinearSolver, realtype};

use super::call::{CallFailed, NULL_RESULT, check};
use super::callbacks::{Callbacks, Convergence, NewtonIterate};
use super::context::Context;
use super::trampoline::{Boundary, boundary, guarded_or};
use super::vector::NVector;

/// Code of a fatal error.
const FATAL: c_int = -1;

/// An owned Newton solver of SUNDIALS.
pub(crate) struct NonlinearSolver(NonNull<sys::_generic_SUNNonlinearSolver>);

impl NonlinearSolver {
    /// Creates a Newton solver for vectors of the same type and length as `y`.
    pub(crate) fn new(y: &NVector, context: &Context) -> Result<Self, CallFailed> {
        // SAFETY: vector and context are alive; the vector is cloned.
        let solver = unsafe { sys::SUNNonlinSol_Newton(y.raw(), context.raw()) };
        let solver = NonNull::new(solver);
        Ok(Self(solver.ok_or(CallFailed::new("SUNNonlinSol_Newton", NULL_RESULT))?))
    }

    /// Creates a Newton solver for `count` vectors of the same type and length as `y`.
    pub(crate) fn of_many(
        count: usize,
        y: &NVector,
        context: &Context,
    ) -> Result<Self, CallFailed> {
        // SAFETY: vector and context are alive; the vector is cloned.
        let solver =
            unsafe { sys::SUNNonlinSol_NewtonSens(count as c_int, y.raw(), context.raw()) };
        let solver = NonNull::new(solver);
        Ok(Self(solver.ok_or(CallFailed::new("SUNNonlinSol_NewtonSens", NULL_RESULT))?))
    }

    /// Replaces the convergence test by the test of the callbacks. IDAS sets its default test when the solver is
    /// attached.
    pub(crate) fn set_test<C: Callbacks>(
        &mut self,
        data: NonNull<Boundary<C>>,
    ) -> Result<(), CallFailed> {
        let test: sys::SUNNonlinSolConvTestFn = Some(convergence_test::<C>);
        // SAFETY: the solver is alive; the test is compatible with the data, which outlive the integrator (see `Ida`).
        let code =
            unsafe { sys::SUNNonlinSolSetConvTestFn(self.raw(), test, data.as_ptr().cast()) };
        check("SUNNonlinSolSetConvTestFn", code)
    }

    pub(crate) fn raw(&self) -> SUNNonlinearSolver {
        self.0.as_ptr()
    }
}

impl Drop for NonlinearSolver {
    fn drop(&mut self) {
        // SAFETY: this value owns the solver, which is freed only here, before its context and after the integrator
        // that uses it (see `Ida`).
        unsafe { sys::SUNNonlinSolFree(self.raw()) };
    }
}

/// Implements SUNNonlinSolConvTestFn.
///
/// # Safety
/// Must be called by the Newton solver of SUNDIALS with its vectors and the address passed to
/// [`NonlinearSolver::set_test`].
unsafe extern "C" fn convergence_test<C: Callbacks>(
    solver: SUNNonlinearSolver,
    _change: N_Vector,
    correction: N_Vector,
    tolerance: realtype,
    weights: N_Vector,
    data: *mut c_void,
) -> c_int {
    let mut number = 0;
    // SAFETY: the solver is alive; one number is written.
    if unsafe { sys::SUNNonlinSolGetCurIter(solver, &mut number) } != 0 {
        return FATAL;
    }
    // SAFETY: both vectors are alive and have the same length.
    let correction = unsafe { sys::N_VWrmsNorm(correction, weights) };
    let iterate = NewtonIterate { number: number as usize, correction, tolerance };
    // SAFETY: SUNDIALS passes back the address of our boundary, and callbacks are not nested.
    let boundary = unsafe { boundary::<C>(data) };
    guarded_or(boundary, FATAL, |callbacks| match callbacks.convergence(&iterate) {
        Convergence::Converged => 0,
        Convergence::Continue => sys::SUN_NLS_CONTINUE,
        Convergence::Failed => sys::SUN_NLS_CONV_RECVR,
    })
}

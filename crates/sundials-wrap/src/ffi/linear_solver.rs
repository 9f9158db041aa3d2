//! Linear solver called by IDAS. It forwards each solve to safe Rust.

use std::os::raw::{c_int, c_void};
use std::ptr::NonNull;

use sundials_sys::{
    _generic_SUNLinearSolver, N_Vector, SUNLinSolFreeEmpty, SUNLinSolNewEmpty, SUNLinearSolver,
    SUNLinearSolver_ID, SUNLinearSolver_ID_SUNLINEARSOLVER_CUSTOM, SUNLinearSolver_Type,
    SUNLinearSolver_Type_SUNLINEARSOLVER_DIRECT, SUNMatrix, realtype,
};

use super::call::{CallFailed, NULL_RESULT};
use super::context::Context;

/// Solve operation with the arguments solver, matrix, x, b and tolerance.
pub(crate) type Solve =
    unsafe extern "C" fn(SUNLinearSolver, SUNMatrix, N_Vector, N_Vector, realtype) -> c_int;

/// An owned direct solver. The Jacobian callback of IDAS performs the setup.
pub(crate) struct LinearSolver(NonNull<_generic_SUNLinearSolver>);

impl LinearSolver {
    /// Creates a solver that calls `solve` for each solve. `content` is the pointer available to `solve`.
    pub(crate) fn new(
        content: *mut c_void,
        solve: Solve,
        context: &Context,
    ) -> Result<Self, CallFailed> {
        // SAFETY: the context is alive.
        let solver = unsafe { SUNLinSolNewEmpty(context.raw()) };
        let mut handle =
            NonNull::new(solver).ok_or(CallFailed::new("SUNLinSolNewEmpty", NULL_RESULT))?;
        // SAFETY: the object was just created and is borrowed only here.
        let solver = unsafe { handle.as_mut() };
        solver.content = content;
        // SAFETY: every SUNLinearSolver owns a table of operations.
        let ops = unsafe { &mut *solver.ops };
        ops.gettype = Some(direct_type);
        ops.getid = Some(custom_id);
        ops.initialize = Some(nothing);
        ops.setup = Some(nothing_with_matrix);
        ops.solve = Some(solve);
        Ok(Self(handle))
    }

    pub(crate) fn raw(&self) -> SUNLinearSolver {
        self.0.as_ptr()
    }
}

impl Drop for LinearSolver {
    fn drop(&mut self) {
        // SAFETY: this value owns the solver, which is freed only here, before its context and after the integrator
        // that uses it (see `Ida`). C does not free its content.
        unsafe { SUNLinSolFreeEmpty(self.raw()) };
    }
}

unsafe extern "C" fn direct_type(_: SUNLinearSolver) -> SUNLinearSolver_Type {
    SUNLinearSolver_Type_SUNLINEARSOLVER_DIRECT
}

unsafe extern "C" fn custom_id(_: SUNLinearSolver) -> SUNLinearSolver_ID {
    SUNLinearSolver_ID_SUNLINEARSOLVER_CUSTOM
}

unsafe extern "C" fn nothing(_: SUNLinearSolver) -> c_int {
    0
}

unsafe extern "C" fn nothing_with_matrix(_: SUNLinearSolver, _: SUNMatrix) -> c_int {
    0
}

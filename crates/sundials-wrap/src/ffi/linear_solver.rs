//! The linear solver IDAS calls: it passes every solve on to safe Rust.

use std::os::raw::{c_int, c_void};
use std::ptr::NonNull;

use sundials_sys::{
    _generic_SUNLinearSolver, SUNLinSolFreeEmpty, SUNLinSolNewEmpty, SUNLinearSolver,
    SUNLinearSolver_ID, SUNLinearSolver_ID_SUNLINEARSOLVER_CUSTOM, SUNLinearSolver_Type,
    SUNLinearSolver_Type_SUNLINEARSOLVER_DIRECT, SUNMatrix,
};

use super::call::{CallFailed, NULL_RESULT};
use super::context::Context;
use super::pinned::Pinned;
use super::trampoline::{self, Boundary, Callbacks};

/// An owned direct solver. IDAS' Jacobian callback is its set-up.
pub(crate) struct LinearSolver(NonNull<_generic_SUNLinearSolver>);

impl LinearSolver {
    /// A solver that calls back through the boundary.
    pub(crate) fn new<C: Callbacks>(
        boundary: &Pinned<Boundary<C>>,
        context: &Context,
    ) -> Result<Self, CallFailed> {
        // SAFETY: the context is alive.
        let solver = unsafe { SUNLinSolNewEmpty(context.raw()) };
        let mut handle =
            NonNull::new(solver).ok_or(CallFailed::new("SUNLinSolNewEmpty", NULL_RESULT))?;
        // SAFETY: just made, and borrowed here only.
        let solver = unsafe { handle.as_mut() };
        solver.content = boundary.address().as_ptr().cast::<c_void>();
        // SAFETY: every SUNLinearSolver owns a table of operations.
        let ops = unsafe { &mut *solver.ops };
        ops.gettype = Some(direct_type);
        ops.getid = Some(custom_id);
        ops.initialize = Some(nothing);
        ops.setup = Some(nothing_with_matrix);
        ops.solve = Some(trampoline::linear_solve::<C>);
        Ok(Self(handle))
    }

    pub(crate) fn raw(&self) -> SUNLinearSolver {
        self.0.as_ptr()
    }
}

impl Drop for LinearSolver {
    fn drop(&mut self) {
        // SAFETY: ours, freed here only, before its context and after the integrator that uses it
        // (see `Ida`); its content is not C's to free.
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

//! The linear solvers IDAS calls: SUNDIALS' KLU, or one of the user's.

use std::os::raw::{c_int, c_void};
use std::ptr::NonNull;

use myovib_sparse::klu::RawOptions;
use suitesparse_sys::klu_l_common;
use sundials_sys::{
    _generic_SUNLinearSolver, SUNLinSol_KLU, SUNLinSol_KLUGetCommon, SUNLinSolFree,
    SUNLinSolFreeEmpty, SUNLinSolNewEmpty, SUNLinearSolver, SUNLinearSolver_ID,
    SUNLinearSolver_ID_SUNLINEARSOLVER_CUSTOM, SUNLinearSolver_Type,
    SUNLinearSolver_Type_SUNLINEARSOLVER_DIRECT, SUNMatrix,
};

use super::call::{CallFailed, NULL_RESULT};
use super::context::Context;
use super::matrix::Matrix;
use super::pinned::Pinned;
use super::trampoline::{self, Boundary, Callbacks};
use super::vector::NVector;

/// An owned linear solver.
pub(crate) struct LinearSolver {
    handle: NonNull<_generic_SUNLinearSolver>,
    free: Free,
    /// KLU's control block inside the solver, alive as long as the solver.
    common: Option<NonNull<klu_l_common>>,
}

type Free = unsafe fn(SUNLinearSolver);

impl LinearSolver {
    /// SUNDIALS' KLU for a sparse `matrix`.
    pub(crate) fn klu(
        template: &NVector,
        matrix: &Matrix,
        options: RawOptions,
        context: &Context,
    ) -> Result<Self, CallFailed> {
        // SAFETY: vector, matrix and context are alive; the solver keeps none of the first two.
        let solver = unsafe { SUNLinSol_KLU(template.raw(), matrix.raw(), context.raw()) };
        let handle = NonNull::new(solver).ok_or(CallFailed::new("SUNLinSol_KLU", NULL_RESULT))?;
        // SAFETY: the solver was just made by SUNLinSol_KLU.
        let common = unsafe { SUNLinSol_KLUGetCommon(handle.as_ptr()) };
        // Both bindings are made from the same klu.h: the same structure under two names.
        let common = NonNull::new(common.cast::<klu_l_common>());
        let mut solver = Self {
            handle,
            free: free_klu,
            common,
        };
        let mut control = solver
            .common()
            .ok_or(CallFailed::new("SUNLinSol_KLUGetCommon", NULL_RESULT))?;
        control.ordering = options.ordering;
        control.btf = options.btf;
        control.scale = options.scale;
        control.tol = options.pivot_tolerance;
        solver.set_common(control);
        Ok(solver)
    }

    /// A direct solver that passes every solve on to the callbacks. IDAS' Jacobian callback is
    /// its set-up.
    pub(crate) fn structured<C: Callbacks>(
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
        ops.solve = Some(trampoline::structured_solve::<C>);
        Ok(Self {
            handle,
            free: free_empty,
            common: None,
        })
    }

    pub(crate) fn raw(&self) -> SUNLinearSolver {
        self.handle.as_ptr()
    }

    /// KLU's control block, copied out; `None` for another solver.
    pub(crate) fn common(&self) -> Option<klu_l_common> {
        // SAFETY: the block lives inside the solver, which is alive; C writes to it only in calls
        // that take `&mut` of the owner.
        self.common.map(|common| unsafe { common.read() })
    }

    /// Makes KLU's last condition estimate none, as it is before the first.
    pub(crate) fn forget_rcond(&mut self) {
        if let Some(mut control) = self.common() {
            control.rcond = -1.0;
            self.set_common(control);
        }
    }

    fn set_common(&mut self, control: klu_l_common) {
        if let Some(common) = self.common {
            // SAFETY: as above, with a unique borrow of the solver.
            unsafe { common.write(control) };
        }
    }

    /// Where KLU leaves its reciprocal condition estimate.
    pub(crate) fn common_address(&self) -> Option<NonNull<klu_l_common>> {
        self.common
    }
}

impl Drop for LinearSolver {
    fn drop(&mut self) {
        // SAFETY: ours, freed here only, by the function that fits how it was made, before its
        // context and after the integrator that uses it (see `Ida`).
        unsafe { (self.free)(self.raw()) };
    }
}

/// # Safety
/// `solver` came from SUNLinSol_KLU and is not used again.
unsafe fn free_klu(solver: SUNLinearSolver) {
    // SAFETY: the caller's promise.
    unsafe { SUNLinSolFree(solver) };
}

/// # Safety
/// `solver` came from SUNLinSolNewEmpty and is not used again; its content is not C's to free.
unsafe fn free_empty(solver: SUNLinearSolver) {
    // SAFETY: the caller's promise.
    unsafe { SUNLinSolFreeEmpty(solver) };
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

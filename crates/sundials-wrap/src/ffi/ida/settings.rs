//! Settings of the integrator: one method per setter of IDAS.

use std::os::raw::c_int;

use sundials_sys as sys;

use super::super::call::{CallFailed, check};
use super::super::callbacks::Callbacks;
use super::super::nonlinear_solver::NonlinearSolver;
use super::super::trampoline;
use super::super::vector::NVector;
use super::Ida;

/// Defines methods that pass a value of the given type to a setter of IDAS.
macro_rules! setters {
    ($($(#[$doc:meta])* $name:ident($value:ty) $setter:ident;)+) => {
        $(
            $(#[$doc])*
            pub(crate) fn $name(&mut self, value: $value) -> Result<(), CallFailed> {
                self.set(stringify!($setter), sys::$setter, value)
            }
        )+
    };
}

impl<C: Callbacks> Ida<C> {
    pub(crate) fn set_weight_function(&mut self) -> Result<(), CallFailed> {
        let function: sys::IDAEwtFn = Some(trampoline::error_weights::<C>);
        self.set("IDAWFtolerances", sys::IDAWFtolerances, function)
    }

    setters! {
        set_max_order(i32) IDASetMaxOrd;
        set_initial_step(f64) IDASetInitStep;
        set_min_step(f64) IDASetMinStep;
        set_max_step(f64) IDASetMaxStep;
        /// Sets the maximum number of steps per solve call.
        set_max_steps(i64) IDASetMaxNumSteps;
        set_stop_time(f64) IDASetStopTime;
        set_max_error_test_failures(i32) IDASetMaxErrTestFails;
        set_max_convergence_failures(i32) IDASetMaxConvFails;
        set_max_newton_iterations(i32) IDASetMaxNonlinIters;
        set_nonlinear_coefficient(f64) IDASetNonlinConvCoef;
        set_delta_cj(f64) IDASetDeltaCjLSetup;
    }

    /// Uses the convergence test of the callbacks. Settings of Newton's method are reset to their defaults.
    pub(crate) fn set_convergence_test(&mut self) -> Result<(), CallFailed> {
        let mut solver = NonlinearSolver::new(&self.y, &self.context)?;
        self.set("IDASetNonlinearSolver", sys::IDASetNonlinearSolver, solver.raw())?;
        let set = solver.set_test(self.boundary.address());
        self.nonlinear_solver = Some(solver);
        set
    }

    pub(crate) fn set_suppression(&mut self, on: bool) -> Result<(), CallFailed> {
        self.set("IDASetSuppressAlg", sys::IDASetSuppressAlg, c_int::from(on))
    }

    /// Sets one value per component: 1 for a differential component (or one included in the error test), 0 for an
    /// algebraic (or excluded) component.
    pub(crate) fn set_id(&mut self, id: &[f64]) -> Result<(), CallFailed> {
        self.set_vector("IDASetId", sys::IDASetId, id)
    }

    /// Sets one value per component: 0 for no constraint, 1 for ≥ 0, −1 for ≤ 0, 2 for > 0, −2 for < 0.
    pub(crate) fn set_constraints(&mut self, constraints: &[f64]) -> Result<(), CallFailed> {
        self.set_vector("IDASetConstraints", sys::IDASetConstraints, constraints)
    }

    /// Attaches the root functions of the callbacks. The direction of each function is 0 for both directions, 1 for
    /// rising only, or −1 for falling only.
    pub(crate) fn set_roots(&mut self, directions: &mut [i32]) -> Result<(), CallFailed> {
        let n_roots = self.boundary().callbacks.n_roots();
        assert_eq!(directions.len(), n_roots, "one direction per root function");
        let function: sys::IDARootFn = Some(trampoline::roots::<C>);
        // SAFETY: the block is valid; the function is compatible with the user data and writes n_roots numbers.
        let code = unsafe { sys::IDARootInit(self.memory.raw(), n_roots as c_int, function) };
        check("IDARootInit", code)?;
        self.set("IDASetRootDirection", sys::IDASetRootDirection, directions.as_mut_ptr())
    }

    /// Attaches quadratures that start at `q0`.
    pub(crate) fn init_quadrature(&mut self, q0: &[f64]) -> Result<(), CallFailed> {
        let vector = NVector::from_slice(q0, &self.context)?;
        let function: sys::IDAQuadRhsFn = Some(trampoline::evaluate::<C, true>);
        // SAFETY: the block is valid; the function is compatible with the user data; the vector is copied.
        let code = unsafe { sys::IDAQuadInit(self.memory.raw(), function, vector.raw()) };
        check("IDAQuadInit", code)?;
        self.quadrature = Some(vector);
        Ok(())
    }

    /// Includes the quadratures in the error test.
    pub(crate) fn set_quadrature_tolerances(
        &mut self,
        relative: f64,
        absolute: f64,
    ) -> Result<(), CallFailed> {
        self.set("IDASetQuadErrCon", sys::IDASetQuadErrCon, c_int::from(true))?;
        // SAFETY: the block is valid and borrowed uniquely; two numbers are stored.
        let code = unsafe { sys::IDAQuadSStolerances(self.memory.raw(), relative, absolute) };
        check("IDAQuadSStolerances", code)
    }
}

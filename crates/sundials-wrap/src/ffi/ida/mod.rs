//! Memory block of the integrator: one method per IDAS function.
//!
//! Life cycle: [`Ida::new`] creates the block and attaches callbacks, vectors and the linear solver. Then the settings
//! are applied. Solve calls, queries and reinitializations follow in any order. Finally, the block is dropped.

mod adjoint;
mod counter;
mod sensitivity;
mod settings;

pub(crate) use counter::Counter;

use std::os::raw::{c_int, c_void};
use std::ptr::NonNull;

use sundials_sys as sys;

use super::call::{CallFailed, NULL_RESULT, check};
use super::callbacks::Callbacks;
use super::context::Context;
use super::linear_solver::LinearSolver;
use super::matrix::Matrix;
use super::messages;
use super::nonlinear_solver::NonlinearSolver;
use super::pinned::Pinned;
use super::trampoline::{self, Boundary};
use super::vector::NVector;
use super::vector_clone::zero_clones_of;
use crate::options::VectorArithmetic;
use myovib_dae::ConsistencyMode;

/// Extent of one solve call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// Takes one internal step.
    OneStep,
    /// Integrates up to the output time.
    Normal,
}

/// IDAS' memory block, freed on drop.
struct IdaMemory(NonNull<c_void>);

impl IdaMemory {
    fn raw(&self) -> *mut c_void {
        self.0.as_ptr()
    }
}

impl Drop for IdaMemory {
    fn drop(&mut self) {
        let mut memory = self.raw();
        // SAFETY: the block came from IDACreate and is freed only here, before everything to which it points (field
        // order of `Ida`).
        unsafe { sys::IDAFree(&mut memory) };
    }
}

/// One integrator with all objects to which it refers.
///
/// Fields are dropped in declaration order: the integrator is dropped before the solvers, the matrix, the vectors and
/// the callbacks to which it points. The context, to which all objects point, is dropped last.
pub(crate) struct Ida<C: Callbacks> {
    memory: IdaMemory,
    linear_solver: LinearSolver,
    /// Newton's method with the convergence test of this crate, if it replaces the default of IDAS.
    nonlinear_solver: Option<NonlinearSolver>,
    sensitivity_solver: Option<NonlinearSolver>,
    _matrix: Matrix,
    y: NVector,
    y_dot: NVector,
    scratch: NVector,
    quadrature: Option<NVector>,
    sensitivities: Option<sensitivity::Sensitivities>,
    /// Backward problems, if checkpoints are stored.
    adjoint: Option<Vec<adjoint::Backward<C>>>,
    boundary: Pinned<Boundary<C>>,
    context: Context,
}

// SAFETY: this value alone owns all C objects here. They refer only to each other and have no thread-local state, so
// any thread may use them, but only one thread at a time. The callbacks are not C objects and must be Send themselves.
unsafe impl<C: Callbacks + Send> Send for Ida<C> {}

/// Defines methods that return a value of the given type from a getter of IDAS.
macro_rules! getters {
    ($($name:ident($value:ty) $getter:ident;)+) => {
        $(
            pub(crate) fn $name(&self) -> $value {
                self.get(sys::$getter)
            }
        )+
    };
}

impl<C: Callbacks> Ida<C> {
    /// Creates an integrator at (t0, y0, ẏ0) with provisional tolerances.
    ///
    /// # Panics
    /// Panics unless `y0` and `y_dot0` have the same positive length.
    pub(crate) fn new(
        callbacks: C,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
        vectors: VectorArithmetic,
    ) -> Result<Self, CallFailed> {
        assert!(!y0.is_empty(), "unknowns");
        assert_eq!(y0.len(), y_dot0.len(), "one derivative for each unknown");
        // On an early return, locals are dropped in reverse order, so the integrator is dropped first in this case,
        // too.
        let context = Context::new(vectors)?;
        let boundary = Pinned::new(Boundary::new(callbacks));
        let mut y = NVector::from_slice(y0, &context)?;
        // IDAInit clones this vector for all its internal vectors.
        zero_clones_of(&mut y);
        let y_dot = NVector::from_slice(y_dot0, &context)?;
        let scratch = NVector::zeros(y0.len(), &context)?;
        let matrix = Matrix::new(&context)?;
        let linear_solver = LinearSolver::new(
            boundary.address().as_ptr().cast(),
            trampoline::linear_solve::<C>,
            &context,
        )?;

        // SAFETY: the context is alive.
        let memory = unsafe { sys::IDACreate(context.raw()) };
        let memory = NonNull::new(memory).ok_or(CallFailed::new("IDACreate", NULL_RESULT))?;
        let memory = IdaMemory(memory);
        let mut ida = Self {
            memory,
            linear_solver,
            nonlinear_solver: None,
            sensitivity_solver: None,
            _matrix: matrix,
            y,
            y_dot,
            scratch,
            quadrature: None,
            sensitivities: None,
            adjoint: None,
            boundary,
            context,
        };
        ida.attach(t0)?;
        Ok(ida)
    }

    fn attach(&mut self, t0: f64) -> Result<(), CallFailed> {
        let memory = self.memory.raw();
        let data = self.boundary.address().as_ptr().cast::<c_void>();
        // SAFETY: the block was created with this context; the data outlive the block (field order of `Ida`).
        unsafe { messages::redirect_messages::<C>(&self.context, memory, data) }?;
        self.set("IDASetUserData", sys::IDASetUserData, data)?;
        let (y, y_dot) = (self.y.raw(), self.y_dot.raw());
        let residual: sys::IDAResFn = Some(trampoline::evaluate::<C, false>);
        // SAFETY: the residual function is compatible with the user data; both vectors have the same length and are
        // copied.
        let code = unsafe { sys::IDAInit(memory, residual, t0, y, y_dot) };
        check("IDAInit", code)?;
        let solver = self.linear_solver.raw();
        // SAFETY: solver and matrix belong together, are compatible with the vectors and outlive the block.
        let code = unsafe { sys::IDASetLinearSolver(memory, solver, self._matrix.raw()) };
        check("IDASetLinearSolver", code)?;
        let jacobian: sys::IDALsJacFn = Some(trampoline::linear_setup::<C>);
        self.set("IDASetJacFn", sys::IDASetJacFn, jacobian)
    }

    /// Calls an IDAS function that sets one value.
    fn set<V>(
        &mut self,
        call: &'static str,
        function: unsafe extern "C" fn(*mut c_void, V) -> c_int,
        value: V,
    ) -> Result<(), CallFailed> {
        // SAFETY: the block is valid and borrowed uniquely; every function passed in this module
        // stores a number, a matching function pointer, or a copy of a live vector.
        let code = unsafe { function(self.memory.raw(), value) };
        check(call, code)
    }

    /// Calls an IDAS function that reads one value. It fails only for a null block, which cannot occur.
    fn get<V: Default>(&self, function: unsafe extern "C" fn(*mut c_void, *mut V) -> c_int) -> V {
        let mut value = V::default();
        // SAFETY: the block is valid; every function passed in this module writes one value.
        unsafe { function(self.memory.raw(), &mut value) };
        value
    }

    /// Calls an IDAS function that writes a vector. The result is written to the scratch vector.
    fn get_vector(
        &mut self,
        call: &'static str,
        function: unsafe extern "C" fn(*mut c_void, sys::N_Vector) -> c_int,
    ) -> Result<&[f64], CallFailed> {
        let scratch = self.scratch.raw();
        self.set(call, function, scratch)?;
        Ok(self.scratch.as_slice())
    }

    /// Calls an IDAS function that copies a vector.
    fn set_vector(
        &mut self,
        call: &'static str,
        function: unsafe extern "C" fn(*mut c_void, sys::N_Vector) -> c_int,
        values: &[f64],
    ) -> Result<(), CallFailed> {
        self.scratch.as_mut_slice().copy_from_slice(values);
        let scratch = self.scratch.raw();
        self.set(call, function, scratch)
    }

    pub(crate) fn boundary(&self) -> &Boundary<C> {
        self.boundary.get()
    }

    pub(crate) fn boundary_mut(&mut self) -> &mut Boundary<C> {
        self.boundary.get_mut()
    }

    /// Frees the integrator and returns the callbacks.
    pub(crate) fn into_callbacks(self) -> C {
        let boundary = {
            let ida = self;
            // All other fields are dropped at the end of this block, in declaration order.
            ida.boundary
        };
        boundary.into_inner().callbacks
    }

    // ---- integration ----

    /// Calls IDASolve, or IDASolveF if checkpoints are stored. Returns the return code and the time of y and ẏ.
    pub(crate) fn solve(&mut self, t_out: f64, task: Task) -> (i32, f64) {
        let task = match task {
            Task::OneStep => sys::IDA_ONE_STEP,
            Task::Normal => sys::IDA_NORMAL,
        };
        let mut t = f64::NAN;
        let (memory, y, y_dot) = (self.memory.raw(), self.y.raw(), self.y_dot.raw());
        let mut checkpoints = 0;
        let code = match self.adjoint {
            // SAFETY: the block and everything to which it points are valid and borrowed uniquely; no reference into
            // the boundary is live; y and ẏ are owned by this value and have the right length.
            None => unsafe { sys::IDASolve(memory, t_out, &mut t, y, y_dot, task) },
            // SAFETY: as above.
            Some(_) => unsafe {
                sys::IDASolveF(memory, t_out, &mut t, y, y_dot, task, &mut checkpoints)
            },
        };
        (code, t)
    }

    /// Calls IDACalcIC and copies the corrected values to y and ẏ. Corrects all of y or, by default, the algebraic
    /// components of y and the differential components of ẏ.
    pub(crate) fn correct_initial_values(
        &mut self,
        mode: ConsistencyMode,
        t_first: f64,
    ) -> Result<(), CallFailed> {
        let option = match mode {
            ConsistencyMode::States => sys::IDA_Y_INIT,
            _ => sys::IDA_YA_YDP_INIT,
        };
        // SAFETY: as in `solve`.
        let code = unsafe { sys::IDACalcIC(self.memory.raw(), option, t_first) };
        check("IDACalcIC", code)?;
        let (y, y_dot) = (self.y.raw(), self.y_dot.raw());
        // SAFETY: the block is valid; the vectors are owned by this value and have the right length.
        let code = unsafe { sys::IDAGetConsistentIC(self.memory.raw(), y, y_dot) };
        check("IDAGetConsistentIC", code)
    }

    /// Reinitializes at (t0, y0, ẏ0, q0) and keeps all settings.
    pub(crate) fn reinit(
        &mut self,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
        q0: &[f64],
    ) -> Result<(), CallFailed> {
        self.y.as_mut_slice().copy_from_slice(y0);
        self.y_dot.as_mut_slice().copy_from_slice(y_dot0);
        let (y, y_dot) = (self.y.raw(), self.y_dot.raw());
        // SAFETY: the block is valid; the vectors have the right length and are copied.
        let code = unsafe { sys::IDAReInit(self.memory.raw(), t0, y, y_dot) };
        check("IDAReInit", code)?;
        self.forget_checkpoints()?;
        if let Some(vector) = &mut self.quadrature {
            vector.as_mut_slice().copy_from_slice(q0);
            let vector = vector.raw();
            self.set("IDAQuadReInit", sys::IDAQuadReInit, vector)?;
        }
        Ok(())
    }

    /// Overwrites the y and ẏ returned. IDAS writes them but does not read them.
    pub(crate) fn set_state(&mut self, y: &[f64], y_dot: &[f64]) {
        self.y.as_mut_slice().copy_from_slice(y);
        self.y_dot.as_mut_slice().copy_from_slice(y_dot);
    }

    // ---- results ----

    pub(crate) fn y(&self) -> &[f64] {
        self.y.as_slice()
    }

    pub(crate) fn y_dot(&self) -> &[f64] {
        self.y_dot.as_slice()
    }

    /// Returns the k-th derivative of the interpolating polynomial at t.
    pub(crate) fn derivative(&mut self, t: f64, k: i32) -> Result<&[f64], CallFailed> {
        let scratch = self.scratch.raw();
        // SAFETY: the block is valid; the vector is owned by this value and has the right length.
        let code = unsafe { sys::IDAGetDky(self.memory.raw(), t, k, scratch) };
        check("IDAGetDky", code)?;
        Ok(self.scratch.as_slice())
    }

    pub(crate) fn n_quadratures(&self) -> usize {
        self.quadrature.as_ref().map_or(0, |vector| vector.as_slice().len())
    }

    /// Returns the k-th derivative of the quadratures at t.
    pub(crate) fn quadrature(&mut self, t: f64, k: i32) -> Result<&[f64], CallFailed> {
        let vector = self.quadrature.as_ref();
        let vector = vector.ok_or(CallFailed::new("IDAGetQuadDky", sys::IDA_NO_QUAD))?;
        // SAFETY: the block is valid; the vector has the length of the quadratures.
        let code = unsafe { sys::IDAGetQuadDky(self.memory.raw(), t, k, vector.raw()) };
        check("IDAGetQuadDky", code)?;
        Ok(vector.as_slice())
    }

    pub(crate) fn error_weights(&mut self) -> Result<&[f64], CallFailed> {
        self.get_vector("IDAGetErrWeights", sys::IDAGetErrWeights)
    }

    pub(crate) fn estimated_local_errors(&mut self) -> Result<&[f64], CallFailed> {
        self.get_vector("IDAGetEstLocalErrors", sys::IDAGetEstLocalErrors)
    }

    /// Returns 1 or −1 for each root function with a rising or falling crossing, and 0 for each other function.
    pub(crate) fn root_info(&mut self) -> Result<Vec<i32>, CallFailed> {
        let mut found = vec![0; self.boundary().callbacks.n_roots()];
        self.set("IDAGetRootInfo", sys::IDAGetRootInfo, found.as_mut_ptr())?;
        Ok(found)
    }

    pub(crate) fn counter(&self, counter: Counter) -> u64 {
        self.get(counter.function()).max(0) as u64
    }

    pub(crate) fn last_order(&self) -> usize {
        self.get(sys::IDAGetLastOrder).max(0) as usize
    }

    pub(crate) fn current_order(&self) -> usize {
        self.get(sys::IDAGetCurrentOrder).max(0) as usize
    }

    getters! {
        last_step(f64) IDAGetLastStep;
        current_step(f64) IDAGetCurrentStep;
        initial_step(f64) IDAGetActualInitStep;
        internal_time(f64) IDAGetCurrentTime;
        c_j(f64) IDAGetCurrentCj;
        tolerance_scale_factor(f64) IDAGetTolScaleFactor;
        last_linear_flag(i64) IDAGetLastLinFlag;
    }
}

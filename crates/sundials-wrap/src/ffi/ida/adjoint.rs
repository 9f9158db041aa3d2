//! Checkpoints and backward problems: calls of IDAS and their results.

use std::os::raw::{c_int, c_long, c_void};

use sundials_sys as sys;

use super::super::backward::{self, Link};
use super::super::call::{CallFailed, NULL_RESULT, check};
use super::super::callbacks::{Callbacks, ForwardView};
use super::super::linear_solver::LinearSolver;
use super::super::matrix::Matrix;
use super::super::messages;
use super::super::pinned::Pinned;
use super::super::vector::NVector;
use super::super::vector_clone::zero_clones_of;
use super::sensitivity::raw;
use super::{Counter, Ida};
use crate::adjoint::BackwardOptions;

/// Objects of one backward problem to which IDAS refers or writes. They are dropped after the memory block (field order
/// of [`Ida`]).
pub(super) struct Backward<C> {
    solver: LinearSolver,
    matrix: Matrix,
    y: NVector,
    y_dot: NVector,
    quadrature: Option<NVector>,
    link: Pinned<Link<C>>,
    /// Whether IDAS has accepted all settings of the problem.
    complete: bool,
}

impl<C: Callbacks> Ida<C> {
    /// Stores the solution for backward problems, with a checkpoint every `steps` steps. Between checkpoints, the
    /// solution is interpolated by Hermite polynomials or by the polynomials of the steps.
    pub(crate) fn init_adjoint(&mut self, steps: usize, hermite: bool) -> Result<(), CallFailed> {
        let interpolation = match hermite {
            true => sys::IDA_HERMITE,
            false => sys::IDA_POLYNOMIAL,
        };
        // SAFETY: the block is valid and borrowed uniquely; two numbers are stored.
        let code =
            unsafe { sys::IDAAdjInit(self.memory.raw(), steps as c_long, interpolation as c_int) };
        check("IDAAdjInit", code)?;
        self.adjoint = Some(Vec::new());
        Ok(())
    }

    /// Restarts the checkpoints. The integration itself must already have been restarted.
    pub(super) fn forget_checkpoints(&mut self) -> Result<(), CallFailed> {
        if self.adjoint.is_none() {
            return Ok(());
        }
        // SAFETY: the block is valid and has checkpoints.
        check("IDAAdjReInit", unsafe { sys::IDAAdjReInit(self.memory.raw()) })
    }

    /// Attaches a backward problem that starts at t from the given y and ẏ. Its quadratures start at zero. The forward
    /// run must have passed t. `id` is 1 for a differential component, 0 for an algebraic one.
    pub(crate) fn add_backward(
        &mut self,
        t: f64,
        start: [&[f64]; 2],
        (options, id, n_quadratures): (&BackwardOptions, &[f64], usize),
    ) -> Result<(), CallFailed> {
        let which = self.complete_parts("IDACreateB")?.len();
        let context = &self.context;
        let mut y = NVector::from_slice(start[0], context)?;
        // IDAInitB clones this vector for all its vectors.
        zero_clones_of(&mut y);
        let y_dot = NVector::from_slice(start[1], context)?;
        let quadrature = match n_quadratures {
            0 => None,
            n => Some(NVector::zeros(n, context)?),
        };
        let link = Pinned::new(Link {
            boundary: self.boundary.address(),
            which,
            n_parameters: self.n_parameters(),
        });
        let content = link.address().as_ptr().cast();
        let part = Backward {
            solver: LinearSolver::new(content, backward::solve::<C>, context)?,
            matrix: Matrix::new(context)?,
            y,
            y_dot,
            quadrature,
            link,
            complete: false,
        };
        let mut number = 0;
        // SAFETY: the block is valid and keeps checkpoints; IDAS assigns zero-based indices to its backward problems.
        let code = unsafe { sys::IDACreateB(self.memory.raw(), &mut number) };
        check("IDACreateB", code)?;
        assert_eq!(number as usize, which, "IDAS counts as we do");
        self.backward_parts("IDACreateB")?.push(part);
        self.start_backward(which, t)?;
        self.attach_backward(which, options, id)?;
        self.backward_parts("IDACreateB")?[which].complete = true;
        Ok(())
    }

    /// Calls IDAInitB and initializes quadratures, with or without sensitivities. The choice must be the same for all
    /// backward problems, because IDAS checks it only once.
    fn start_backward(&mut self, which: usize, t: f64) -> Result<(), CallFailed> {
        let (memory, number) = (self.memory.raw(), which as c_int);
        let with = self.n_parameters() > 0;
        let part = &self.backward_parts("IDAInitB")?[which];
        let (y, y_dot) = (part.y.raw(), part.y_dot.raw());
        let quadrature = part.quadrature.as_ref().map(NVector::raw);
        let code = if with {
            let residual: sys::IDAResFnBS = Some(backward::evaluate_with::<C, false>);
            // SAFETY: the backward problem exists; both vectors have the same length and are copied; the function is
            // compatible with the link, which is its user data.
            unsafe { sys::IDAInitBS(memory, number, residual, t, y, y_dot) }
        } else {
            let residual: sys::IDAResFnB = Some(backward::evaluate::<C, false>);
            // SAFETY: as above.
            unsafe { sys::IDAInitB(memory, number, residual, t, y, y_dot) }
        };
        check("IDAInitB", code)?;
        let Some(quadrature) = quadrature else {
            return Ok(());
        };
        let code = if with {
            let rates: sys::IDAQuadRhsFnBS = Some(backward::evaluate_with::<C, true>);
            // SAFETY: as above.
            unsafe { sys::IDAQuadInitBS(memory, number, rates, quadrature) }
        } else {
            let rates: sys::IDAQuadRhsFnB = Some(backward::evaluate::<C, true>);
            // SAFETY: as above.
            unsafe { sys::IDAQuadInitB(memory, number, rates, quadrature) }
        };
        check("IDAQuadInitB", code)
    }

    /// Attaches the message handler, the user data, the linear solver and the settings of a backward problem.
    fn attach_backward(
        &mut self,
        which: usize,
        options: &BackwardOptions,
        id: &[f64],
    ) -> Result<(), CallFailed> {
        let (memory, number) = (self.memory.raw(), which as c_int);
        let data = self.boundary.address().as_ptr().cast::<c_void>();
        let of_its_own = self.backward_memory(which)?;
        // SAFETY: the block was created with this context; the data outlive the block (field order of `Ida`).
        unsafe { messages::redirect_messages::<C>(&self.context, of_its_own, data) }?;
        let tolerances = &options.tolerances;
        let absolute: Vec<f64> = (0..id.len()).map(|i| tolerances.absolute(i)).collect();
        let absolute = NVector::from_slice(&absolute, &self.context)?;
        let id = NVector::from_slice(id, &self.context)?;
        let with = self.n_parameters() > 0;
        let part = &self.backward_parts("IDASetUserDataB")?[which];
        let link = part.link.address().as_ptr().cast::<c_void>();
        let (solver, matrix) = (part.solver.raw(), part.matrix.raw());
        self.set_b("IDASetUserDataB", sys::IDASetUserDataB, which, link)?;
        // SAFETY: solver and matrix belong together, are compatible with the vectors and outlive the block.
        let code = unsafe { sys::IDASetLinearSolverB(memory, number, solver, matrix) };
        check("IDASetLinearSolverB", code)?;
        if with {
            let setup: sys::IDALsJacFnBS = Some(backward::setup_with::<C>);
            self.set_b("IDASetJacFnBS", sys::IDASetJacFnBS, which, setup)?;
        } else {
            let setup: sys::IDALsJacFnB = Some(backward::setup::<C>);
            self.set_b("IDASetJacFnB", sys::IDASetJacFnB, which, setup)?;
        }
        let relative = tolerances.relative();
        // SAFETY: the backward problem exists; the vector has its length and is copied.
        let code = unsafe { sys::IDASVtolerancesB(memory, number, relative, absolute.raw()) };
        check("IDASVtolerancesB", code)?;
        self.set_b("IDASetIdB", sys::IDASetIdB, which, id.raw())?;
        let suppress = c_int::from(options.suppress_algebraic);
        self.set_b("IDASetSuppressAlgB", sys::IDASetSuppressAlgB, which, suppress)?;
        let steps = options.max_steps as c_long;
        self.set_b("IDASetMaxNumStepsB", sys::IDASetMaxNumStepsB, which, steps)?;
        let order = options.max_order as c_int;
        self.set_b("IDASetMaxOrdB", sys::IDASetMaxOrdB, which, order)?;
        if let Some((relative, absolute)) = options.quadrature_tolerances {
            let on = c_int::from(true);
            self.set_b("IDASetQuadErrConB", sys::IDASetQuadErrConB, which, on)?;
            // SAFETY: the backward problem has quadratures; two numbers are stored.
            let code = unsafe { sys::IDAQuadSStolerancesB(memory, number, relative, absolute) };
            check("IDAQuadSStolerancesB", code)?;
        }
        Ok(())
    }

    /// Restarts a backward problem at t. Its quadratures start at zero.
    pub(crate) fn restart_backward(
        &mut self,
        which: usize,
        t: f64,
        start: [&[f64]; 2],
    ) -> Result<(), CallFailed> {
        let (memory, number) = (self.memory.raw(), which as c_int);
        let part = &mut self.backward_parts("IDAReInitB")?[which];
        part.y.as_mut_slice().copy_from_slice(start[0]);
        part.y_dot.as_mut_slice().copy_from_slice(start[1]);
        let (y, y_dot) = (part.y.raw(), part.y_dot.raw());
        let quadrature = part.quadrature.as_mut().map(|vector| {
            vector.as_mut_slice().fill(0.0);
            vector.raw()
        });
        // SAFETY: the backward problem exists; the vectors have its length and are copied.
        let code = unsafe { sys::IDAReInitB(memory, number, t, y, y_dot) };
        check("IDAReInitB", code)?;
        match quadrature {
            Some(vector) => self.set_b("IDAQuadReInitB", sys::IDAQuadReInitB, which, vector),
            None => Ok(()),
        }
    }

    /// Calls IDACalcICB with the forward solution at the start of the backward problem, and copies the corrected
    /// values.
    pub(crate) fn correct_backward(
        &mut self,
        which: usize,
        t_first: f64,
        forward: &ForwardView<'_>,
    ) -> Result<(), CallFailed> {
        let (memory, number) = (self.memory.raw(), which as c_int);
        let vector = |values: &[f64]| NVector::from_slice(values, &self.context);
        let (y, y_dot) = (vector(forward.y)?, vector(forward.y_dot)?);
        let all = |k: usize| {
            let vectors = forward.s.iter().map(|pair| vector(pair[k]));
            vectors.collect::<Result<Vec<_>, _>>()
        };
        let (s, s_dot) = (all(0)?, all(1)?);
        assert_eq!(s.len(), self.n_parameters(), "S for each parameter");
        let code = if s.is_empty() {
            // SAFETY: the backward problem exists and IDAS has run forward; the vectors have the length of the forward
            // problem and are copied; no reference into the boundary is live.
            unsafe { sys::IDACalcICB(memory, number, t_first, y.raw(), y_dot.raw()) }
        } else {
            let (mut s, mut s_dot) = (raw(&s), raw(&s_dot));
            let (s, s_dot) = (s.as_mut_ptr(), s_dot.as_mut_ptr());
            // SAFETY: as above; both arrays contain one vector for each parameter.
            unsafe { sys::IDACalcICBS(memory, number, t_first, y.raw(), y_dot.raw(), s, s_dot) }
        };
        check("IDACalcICB", code)?;
        let part = &self.backward_parts("IDAGetConsistentICB")?[which];
        let (y, y_dot) = (part.y.raw(), part.y_dot.raw());
        // SAFETY: the backward problem exists; the vectors are owned by this value and have the same length.
        let code = unsafe { sys::IDAGetConsistentICB(memory, number, y, y_dot) };
        check("IDAGetConsistentICB", code)
    }

    /// Calls IDASolveB and returns its code. If this code does not report a failure, all backward problems have reached
    /// `t_out`.
    pub(crate) fn solve_backward(&mut self, t_out: f64) -> Result<i32, CallFailed> {
        self.complete_parts("IDASolveB")?;
        // SAFETY: the block and everything it points to are valid and borrowed uniquely; no reference into the boundary
        // is live; all backward problems are complete.
        Ok(unsafe { sys::IDASolveB(self.memory.raw(), t_out, sys::IDA_NORMAL) })
    }

    /// Returns y, ẏ and the quadratures of a backward problem after a call of IDASolveB.
    pub(crate) fn backward_values(&mut self, which: usize) -> Result<[&[f64]; 3], CallFailed> {
        let (memory, number) = (self.memory.raw(), which as c_int);
        let mut t = 0.0;
        let part = &self.backward_parts("IDAGetB")?[which];
        let (y, y_dot) = (part.y.raw(), part.y_dot.raw());
        // SAFETY: the backward problem exists; the vectors are owned by this value and have the same length.
        let code = unsafe { sys::IDAGetB(memory, number, &mut t, y, y_dot) };
        check("IDAGetB", code)?;
        let quadrature = match &part.quadrature {
            None => &[],
            Some(vector) => {
                // SAFETY: as above; the vector has the length of the quadratures.
                let code = unsafe { sys::IDAGetQuadB(memory, number, &mut t, vector.raw()) };
                check("IDAGetQuadB", code)?;
                vector.as_slice()
            }
        };
        Ok([part.y.as_slice(), part.y_dot.as_slice(), quadrature])
    }

    /// Returns the initial y and ẏ of a backward problem, as corrected by
    /// [`Self::correct_backward`].
    pub(crate) fn backward_start(&mut self, which: usize) -> Result<[&[f64]; 2], CallFailed> {
        let part = &self.backward_parts("IDAGetConsistentICB")?[which];
        Ok([part.y.as_slice(), part.y_dot.as_slice()])
    }

    pub(crate) fn backward_counter(
        &mut self,
        which: usize,
        counter: Counter,
    ) -> Result<u64, CallFailed> {
        let mut value = 0;
        let memory = self.backward_memory(which)?;
        // SAFETY: the memory block of a backward problem is a block of IDAS; one value is written.
        let code = unsafe { counter.function()(memory, &mut value) };
        check("IDAGetNumSteps", code)?;
        Ok(value.max(0) as u64)
    }

    /// Returns the memory block of a backward problem, which belongs to the forward block.
    fn backward_memory(&mut self, which: usize) -> Result<*mut c_void, CallFailed> {
        // SAFETY: the block is valid; IDAS returns null if the problem does not exist.
        let memory = unsafe { sys::IDAGetAdjIDABmem(self.memory.raw(), which as c_int) };
        match memory.is_null() {
            true => Err(CallFailed::new("IDAGetAdjIDABmem", NULL_RESULT)),
            false => Ok(memory),
        }
    }

    /// Returns the backward problems. Fails if IDAS has rejected a setting of one of them, because IDAS keeps such an
    /// incomplete problem.
    fn complete_parts(&mut self, call: &'static str) -> Result<&[Backward<C>], CallFailed> {
        let parts = self.backward_parts(call)?;
        match parts.iter().all(|part| part.complete) {
            true => Ok(parts),
            false => Err(CallFailed::new(call, sys::IDA_ILL_INPUT)),
        }
    }

    fn backward_parts(&mut self, call: &'static str) -> Result<&mut Vec<Backward<C>>, CallFailed> {
        let refused = CallFailed::new(call, sys::IDA_NO_ADJ);
        self.adjoint.as_mut().ok_or(refused)
    }

    /// Calls an IDAS function that stores one value for a backward problem.
    fn set_b<V>(
        &mut self,
        call: &'static str,
        function: unsafe extern "C" fn(*mut c_void, c_int, V) -> c_int,
        which: usize,
        value: V,
    ) -> Result<(), CallFailed> {
        // SAFETY: as in `Ida::set`, for a backward problem that exists.
        let code = unsafe { function(self.memory.raw(), which as c_int, value) };
        check(call, code)
    }
}

//! Forward sensitivities in IDAS.

use std::os::raw::c_int;

use sundials_sys as sys;

use super::super::call::{CallFailed, check};
use super::super::callbacks::Callbacks;
use super::super::nonlinear_solver::NonlinearSolver;
use super::super::sensitivity_residual::{quadrature, residual};
use super::super::vector::NVector;
use super::Ida;

/// S and Ṡ for each parameter. IDAS reads their initial values and writes their consistent values.
pub(crate) struct Sensitivities {
    s: Vec<NVector>,
    s_dot: Vec<NVector>,
    method: c_int,
    /// Sensitivities of the quadratures, if there are any.
    quadratures: Vec<NVector>,
}

pub(super) fn raw(vectors: &[NVector]) -> Vec<sys::N_Vector> {
    vectors.iter().map(NVector::raw).collect()
}

impl Sensitivities {
    fn fill(&mut self, starts: &[[Vec<f64>; 2]]) {
        let vectors = self.s.iter_mut().zip(&mut self.s_dot);
        for ((s, s_dot), [start, slope]) in vectors.zip(starts) {
            s.as_mut_slice().copy_from_slice(start);
            s_dot.as_mut_slice().copy_from_slice(slope);
        }
    }
}

impl<C: Callbacks> Ida<C> {
    /// Attaches sensitivities with the initial values S and Ṡ, one pair for each parameter. `scales` contains the
    /// typical magnitudes of the parameters.
    pub(crate) fn init_sensitivities(
        &mut self,
        starts: &[[Vec<f64>; 2]],
        scales: &mut [f64],
        staggered: bool,
        in_error_test: bool,
    ) -> Result<(), CallFailed> {
        assert_eq!(starts.len(), scales.len(), "a scale for each parameter");
        let vectors = |k: usize| {
            let new = |start: &[Vec<f64>; 2]| NVector::from_slice(&start[k], &self.context);
            starts.iter().map(new).collect::<Result<Vec<_>, _>>()
        };
        let sensitivities = Sensitivities {
            s: vectors(0)?,
            s_dot: vectors(1)?,
            quadratures: Vec::new(),
            method: if staggered {
                sys::IDA_STAGGERED as c_int
            } else {
                sys::IDA_SIMULTANEOUS as c_int
            },
        };
        let (mut s, mut s_dot) = (raw(&sensitivities.s), raw(&sensitivities.s_dot));
        let (memory, n) = (self.memory.raw(), starts.len() as c_int);
        let function: sys::IDASensResFn = Some(residual::<C>);
        let (method, s, s_dot) = (sensitivities.method, s.as_mut_ptr(), s_dot.as_mut_ptr());
        // SAFETY: the block is valid; the function is compatible with the user data; both arrays contain n vectors of
        // the right length, which are copied.
        let code = unsafe { sys::IDASensInit(memory, n, method, function, s, s_dot) };
        check("IDASensInit", code)?;
        // SAFETY: the block is valid and has sensitivities.
        let code = unsafe { sys::IDASensEEtolerances(memory) };
        check("IDASensEEtolerances", code)?;
        let on = c_int::from(in_error_test);
        self.set("IDASetSensErrCon", sys::IDASetSensErrCon, on)?;
        let none = std::ptr::null_mut();
        // SAFETY: the block is valid; the n scales are copied. The parameters themselves are not needed, since this
        // crate provides the residuals of the sensitivities.
        let code = unsafe { sys::IDASetSensParams(memory, none, scales.as_mut_ptr(), none.cast()) };
        check("IDASetSensParams", code)?;
        self.sensitivities = Some(sensitivities);
        match self.nonlinear_solver {
            Some(_) => self.set_convergence_test_of_sensitivities(starts.len(), staggered),
            None => Ok(()),
        }
    }

    /// Uses the convergence test of the callbacks for `n` sensitivities.
    fn set_convergence_test_of_sensitivities(
        &mut self,
        n: usize,
        staggered: bool,
    ) -> Result<(), CallFailed> {
        // The simultaneous method solves for y and all sensitivities at once.
        let count = if staggered { n } else { n + 1 };
        let mut solver = NonlinearSolver::of_many(count, &self.y, &self.context)?;
        match staggered {
            true => self.set(
                "IDASetNonlinearSolverSensStg",
                sys::IDASetNonlinearSolverSensStg,
                solver.raw(),
            ),
            false => self.set(
                "IDASetNonlinearSolverSensSim",
                sys::IDASetNonlinearSolverSensSim,
                solver.raw(),
            ),
        }?;
        let set = solver.set_test(self.boundary.address());
        self.sensitivity_solver = Some(solver);
        set
    }

    /// Reinitializes the sensitivities. The integration itself must already have been reinitialized.
    pub(crate) fn reinit_sensitivities(
        &mut self,
        starts: &[[Vec<f64>; 2]],
    ) -> Result<(), CallFailed> {
        let memory = self.memory.raw();
        let Some(sensitivities) = &mut self.sensitivities else {
            return Ok(());
        };
        sensitivities.fill(starts);
        let (mut s, mut s_dot) = (raw(&sensitivities.s), raw(&sensitivities.s_dot));
        let (method, s, s_dot) = (sensitivities.method, s.as_mut_ptr(), s_dot.as_mut_ptr());
        // SAFETY: as in `init_sensitivities`.
        let code = unsafe { sys::IDASensReInit(memory, method, s, s_dot) };
        check("IDASensReInit", code)?;
        if sensitivities.quadratures.is_empty() {
            return Ok(());
        }
        for vector in &mut sensitivities.quadratures {
            vector.as_mut_slice().fill(0.0);
        }
        let mut zeros = raw(&sensitivities.quadratures);
        // SAFETY: the block has sensitivities of quadratures; the array has one vector for each, which is copied.
        let code = unsafe { sys::IDAQuadSensReInit(memory, zeros.as_mut_ptr()) };
        check("IDAQuadSensReInit", code)
    }

    /// Attaches the sensitivities of the quadratures, which start at zero. If the quadratures have tolerances, these
    /// sensitivities are included in the error test with the same tolerances.
    pub(crate) fn init_quadrature_sensitivities(
        &mut self,
        in_error_test: bool,
    ) -> Result<(), CallFailed> {
        let (memory, n) = (self.memory.raw(), self.n_quadratures());
        let refused = CallFailed::new("IDAQuadSensInit", sys::IDA_NO_SENS);
        let sensitivities = self.sensitivities.as_mut().ok_or(refused)?;
        let zeros = |_: &NVector| NVector::zeros(n, &self.context);
        let zeros: Vec<NVector> = sensitivities.s.iter().map(zeros).collect::<Result<_, _>>()?;
        let function: sys::IDAQuadSensRhsFn = Some(quadrature::<C>);
        // SAFETY: the block is valid; the function is compatible with the user data; the array contains one vector for
        // each parameter, which is copied.
        let code = unsafe { sys::IDAQuadSensInit(memory, function, raw(&zeros).as_mut_ptr()) };
        check("IDAQuadSensInit", code)?;
        sensitivities.quadratures = zeros;
        let on = c_int::from(in_error_test);
        self.set("IDASetQuadSensErrCon", sys::IDASetQuadSensErrCon, on)?;
        // SAFETY: the block is valid and has sensitivities of quadratures.
        let code = unsafe { sys::IDAQuadSensEEtolerances(memory) };
        check("IDAQuadSensEEtolerances", code)
    }

    /// Returns the sensitivity of the quadratures to parameter j at t.
    pub(crate) fn quadrature_sensitivity(
        &mut self,
        j: usize,
        t: f64,
    ) -> Result<&[f64], CallFailed> {
        let memory = self.memory.raw();
        let refused = CallFailed::new("IDAGetQuadSensDky1", sys::IDA_NO_QUADSENS);
        let vectors = self.sensitivities.as_ref().map(|all| &all.quadratures);
        let vector = vectors.and_then(|all| all.get(j)).ok_or(refused)?;
        // SAFETY: the block is valid; the vector is owned by this value and has the length of the quadratures.
        let code = unsafe { sys::IDAGetQuadSensDky1(memory, t, 0, j as c_int, vector.raw()) };
        check("IDAGetQuadSensDky1", code)?;
        Ok(vector.as_slice())
    }

    /// Returns S and Ṡ as corrected by IDACalcIC.
    pub(crate) fn consistent_sensitivities(&mut self) -> Result<Vec<[Vec<f64>; 2]>, CallFailed> {
        let memory = self.memory.raw();
        let Some(sensitivities) = &mut self.sensitivities else {
            return Ok(Vec::new());
        };
        let (mut s, mut s_dot) = (raw(&sensitivities.s), raw(&sensitivities.s_dot));
        // SAFETY: the block is valid; each of the two arrays contains one vector of the right length for each
        // sensitivity. This value owns the vectors, so they may be written to.
        let code =
            unsafe { sys::IDAGetSensConsistentIC(memory, s.as_mut_ptr(), s_dot.as_mut_ptr()) };
        check("IDAGetSensConsistentIC", code)?;
        let pairs = sensitivities.s.iter().zip(&sensitivities.s_dot);
        let copied =
            |(s, s_dot): (&NVector, &NVector)| [s.as_slice().to_vec(), s_dot.as_slice().to_vec()];
        Ok(pairs.map(copied).collect())
    }

    pub(crate) fn n_parameters(&self) -> usize {
        self.sensitivities.as_ref().map_or(0, |all| all.s.len())
    }

    /// Returns the k-th derivative of the sensitivity to parameter j at t.
    pub(crate) fn sensitivity(&mut self, j: usize, t: f64, k: i32) -> Result<&[f64], CallFailed> {
        let (memory, out) = (self.memory.raw(), self.scratch.raw());
        // SAFETY: the block is valid; the vector is owned by this value and has the right length.
        let code = unsafe { sys::IDAGetSensDky1(memory, t, k, j as c_int, out) };
        check("IDAGetSensDky1", code)?;
        Ok(self.scratch.as_slice())
    }
}

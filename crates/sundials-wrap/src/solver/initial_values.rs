//! Correction of inconsistent initial values.

use myovib_dae::checks::{expect, expect_finite_value};
use myovib_dae::{
    ConsistencyMode, Inconsistent, IntegratorError, Problem, StepError, expect_index,
    project_onto_constraints,
};
use sundials_sys as sys;

use super::{IdaSolver, call_error, codes};
use crate::error::Error;
use crate::ffi::call::CallFailed;
use crate::ffi::ida::{Counter, InitialUnknowns};
use crate::options::differential;

/// Convergence threshold of IDACalcIC as a fraction of the tolerance; this is the default of IDAS.
const COEFFICIENT: f64 = 0.0033;

impl<P: Problem> IdaSolver<P> {
    /// Corrects the initial values so that F(t0, y0, ẏ0) = 0, by Newton's method with a line search. Must be called
    /// before the first step. `t_first` is the first output time, which determines the time scale.
    ///
    /// [`Problem::kinds`] determines which components are algebraic. Components excluded from the error test do not
    /// affect this choice.
    ///
    /// # Errors
    /// Returns [`Error::InconsistentInitialValues`] if consistent values are not found, [`Error::Callback`] if the
    /// problem returns a fatal error, and [`IntegratorError::AfterTheStart`] or [`Error::Call`] for misuse.
    pub fn correct_initial_values(
        &mut self,
        mode: ConsistencyMode,
        t_first: f64,
    ) -> Result<(), Error> {
        expect_finite_value("t_first", t_first)?;
        expect("t_first", t_first, t_first != self.t0, "not the initial time")?;
        if self.ida.counter(Counter::Steps) > 0 {
            return Err(IntegratorError::AfterTheStart { t: self.t }.into());
        }
        let t = self.t0;
        expect_index(&self.functions().problem, mode)
            .map_err(|source| IntegratorError::Inconsistent { t, source })?;
        let unknowns = match mode {
            ConsistencyMode::AlgebraicAndDerivatives => InitialUnknowns::AlgebraicAndDerivatives,
            ConsistencyMode::States => InitialUnknowns::States,
            ConsistencyMode::Constraints => return self.project_onto_constraints(t_first),
            other => unreachable!("{other:?} is not a mode of this version"),
        };
        let result = self.ida.set_id(&differential(&self.kinds));
        self.refused(result)?;
        self.functions_mut().failures = Default::default();
        let mut result = match mode {
            // IDACalcIC ends when the correction of ẏ is small over its step, which is a thousandth of the time to the
            // first output. It must be small over that whole time. The coefficient also applies to the correction of
            // sensitivities. Therefore, with sensitivities, the default of IDAS is used, as in published runs.
            ConsistencyMode::AlgebraicAndDerivatives
                if self.functions().sensitivities.is_none() =>
            {
                let differences = Some(1e3 * (t_first - self.t0));
                self.search((1e-3 * COEFFICIENT, differences), unknowns, t_first)?
            }
            _ => self.search((COEFFICIENT, None), unknowns, t_first)?,
        };
        let is_final = self.functions().failures.fatal.is_some();
        if result.is_err() && !is_final && self.ida.boundary().panic.is_none() {
            result = self.search((COEFFICIENT, None), unknowns, t_first)?;
        }
        let restored = match &self.suppressed {
            Some(id) => self.ida.set_id(id),
            None => Ok(()),
        };
        self.resume_panic();
        self.refused(restored)?;
        let Err(failed) = result else {
            self.start_from(self.t0, [self.ida.y().to_vec(), self.ida.y_dot().to_vec()]);
            let consistent = self.ida.consistent_sensitivities();
            let starts = self.refused(consistent)?;
            if let Some(linearized) = &mut self.functions_mut().sensitivities {
                linearized.starts = starts;
            }
            return Ok(());
        };
        Err(self.inconsistent(failed, self.t0))
    }

    /// Searches for initial values with the given coefficient. The given time is the scale for differences of ẏ.
    fn search(
        &mut self,
        (coefficient, differences): (f64, Option<f64>),
        unknowns: InitialUnknowns,
        t_first: f64,
    ) -> Result<Result<(), CallFailed>, Error> {
        self.functions_mut().failures = Default::default();
        let set = self.ida.set_initial_coefficient(coefficient);
        self.refused(set)?;
        self.functions_mut().search_time = differences;
        let found = self.ida.correct_initial_values(unknowns, t_first);
        self.functions_mut().search_time = None;
        Ok(found)
    }

    /// Returns the error for initial values at `t` that could not be made consistent.
    pub(super) fn inconsistent(&mut self, failed: CallFailed, t: f64) -> Error {
        let failures = &mut self.functions_mut().failures;
        if let Some(fatal) = failures.fatal.take() {
            return fatal;
        }
        let message = failures.take_message();
        let code = failed.code;
        if code == sys::IDA_ILL_INPUT {
            return call_error(failed, message);
        }
        let name = codes::name(code);
        Error::InconsistentInitialValues { t, code, name, message }
    }

    /// Moves the initial values onto the constraints of the problem.
    fn project_onto_constraints(&mut self, t_first: f64) -> Result<(), Error> {
        let (t, [mut y, mut y_dot]) = (self.t0, self.start.clone());
        let (kinds, mut weights) = (self.kinds.clone(), vec![0.0; self.n]);
        let functions = self.functions_mut();
        let (problem, weighing) = (&mut functions.problem, &mut functions.weighing);
        let weighed = weighing.write(problem, &y, &mut weights);
        let found = weighed.map_err(Inconsistent::from).and_then(|()| {
            let (times, distance) = ((t, t_first), weighing.distance(&weights));
            project_onto_constraints(
                problem, &kinds, times, &mut y, &mut y_dot, &weights, &distance,
            )
        });
        match found {
            Ok(()) => {
                let mut q = vec![0.0; self.n_quadratures()];
                if !q.is_empty() {
                    self.quadrature_dense_output(t, 0, &mut q)?;
                }
                self.reinit(t, &y, &y_dot, &q)
            }
            Err(Inconsistent::Failed(StepError::Fatal(source))) => {
                Err(Error::Callback { function: "residual or constraints", t, source })
            }
            Err(source) => Err(IntegratorError::Inconsistent { t, source }.into()),
        }
    }
}

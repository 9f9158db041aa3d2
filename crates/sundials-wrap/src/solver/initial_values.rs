//! Correction of inconsistent initial values.

use myovib_dae::checks::{expect, expect_finite_value};
use myovib_dae::{
    ConsistencyMode, Inconsistent, IntegratorError, Problem, StepError, expect_index,
};
use sundials_sys as sys;

use super::callbacks::UserFunctions;
use super::{IdaSolver, call_error, codes};
use crate::error::Error;
use crate::ffi::call::CallFailed;
use crate::ffi::ida::Counter;
use crate::options::differential;

impl<P: Problem> IdaSolver<P> {
    /// Corrects the initial values so that F(t0, y0, ẏ0) = 0, by Newton's method with a line search. Must be called
    /// before the first step. `t_first` is the first output time, which determines the time scale. IDACalcIC is used
    /// only with sensitivities, which it also corrects.
    ///
    /// [`Problem::kinds`] determines which components are algebraic. Components excluded from the error test do not
    /// affect this choice.
    ///
    /// # Errors
    /// Returns [`IntegratorError::Inconsistent`] or, with sensitivities, [`Error::InconsistentInitialValues`] if
    /// consistent values are not found. Returns [`Error::SensitivitiesNotCorrected`] for
    /// [`ConsistencyMode::Constraints`] with sensitivities: at index 2, initial sensitivities must satisfy the derivatives
    /// of the constraints with respect to the parameters. Returns [`Error::Callback`] if the problem returns a fatal
    /// error, and [`IntegratorError::AfterTheStart`] or [`Error::Call`] for misuse.
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
        if self.functions().sensitivities.is_none() {
            return self.correct_state(mode, t_first);
        }
        if mode == ConsistencyMode::Constraints {
            return Err(Error::SensitivitiesNotCorrected);
        }
        let id = differential(&self.kinds);
        self.call(|ida| ida.set_id(&id))?;
        self.functions_mut().failures = Default::default();
        let result = self.ida.correct_initial_values(mode, t_first);
        let id = self.suppressed.clone();
        let restored = self.call(|ida| id.map_or(Ok(()), |id| ida.set_id(&id)));
        self.resume_panic();
        restored?;
        let Err(failed) = result else {
            self.start_from(self.t0, [self.ida.y().to_vec(), self.ida.y_dot().to_vec()]);
            let starts = self.call(|ida| ida.consistent_sensitivities())?;
            if let Some(linearized) = &mut self.functions_mut().sensitivities {
                linearized.starts = starts;
            }
            return Ok(());
        };
        Err(self.inconsistent(failed, self.t0))
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

    /// Corrects the initial values without sensitivities.
    fn correct_state(&mut self, mode: ConsistencyMode, t_first: f64) -> Result<(), Error> {
        let (t, [mut y, mut y_dot]) = (self.t0, self.start.clone());
        let (kinds, mut weights) = (self.kinds.clone(), vec![0.0; self.n]);
        let UserFunctions { problem, weighing, linear, .. } = self.functions_mut();
        let weighed = weighing.write(problem, &y, &mut weights);
        let found = weighed.map_err(Inconsistent::from).and_then(|()| {
            let (times, distance) = ((t, t_first), weighing.distance(&weights));
            let state = [&mut y[..], &mut y_dot];
            linear.correct(problem, mode, &kinds, times, state, [&weights, &distance])
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
                Err(Error::Callback { function: "residual, Jacobian or constraints", t, source })
            }
            Err(source) => Err(IntegratorError::Inconsistent { t, source }.into()),
        }
    }
}

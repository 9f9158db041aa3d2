//! Interruption of steps at roots, and continuation within a step after a root.

use myovib_dae::checks::expect_finite_value;
use myovib_dae::{IntegratorError, LinearSolver, Outcome, Problem};

use super::state::{Pause, RadauSolver};
use crate::dense::Collocation;
use crate::error::RadauError;
use crate::failure::{Failure, Operation};
use crate::roots::LastStep;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Continues to the end of the step, to `limit`, or to the first root, whichever comes first.
    pub(super) fn step_within(
        &mut self,
        t_out: f64,
        limit: Option<f64>,
    ) -> Result<Outcome, RadauError> {
        expect_finite_value("t_out", t_out)?;
        let t = self.t();
        if t_out < t {
            return Err(IntegratorError::TimeBehind { t_out, t }.into());
        }
        let limit = limit.unwrap_or(f64::INFINITY);
        if limit <= t {
            return Ok(Outcome::StopTime { t });
        }
        let outcome = match self.pause {
            None => self.accepted_step(t_out, limit)?,
            // The step has already been computed.
            Some(_) if self.t < limit => Outcome::StepTaken { t: self.t },
            Some(_) => Outcome::StopTime { t: limit },
        };
        match outcome {
            Outcome::StepTaken { t } | Outcome::StopTime { t } => {
                self.pause = None;
                let root = self.root_before(t)?;
                if t < self.t && self.pause.is_none() {
                    self.pause_at(t);
                }
                Ok(root.unwrap_or(outcome))
            }
            other => Ok(other),
        }
    }

    /// Pauses at the first root in the last step up to the time `t`, if there is one.
    fn root_before(&mut self, t: f64) -> Result<Option<Outcome>, RadauError> {
        let Some(roots) = &mut self.roots else {
            return Ok(None);
        };
        let last = LastStep { method: &self.method, collocation: &self.collocation };
        let found = roots.next(&mut self.problem, &last, t, &mut self.counters);
        match found.map_err(Operation::RootFunction.failed()) {
            Ok(None) => Ok(None),
            Ok(Some(root)) => {
                self.pause_at(root.t);
                Ok(Some(Outcome::Root { t: root.t, crossings: root.crossings }))
            }
            Err(Failure::Rejected(rejection)) => {
                Ok(Some(self.stop(rejection.reason, rejection.message)))
            }
            Err(Failure::Fatal(fatal)) => {
                let Collocation { t0, h, .. } = self.collocation;
                Err(fatal.in_step(t0, h))
            }
        }
    }

    /// Sets the current time to `t`, which must be in the last step.
    fn pause_at(&mut self, t: f64) {
        let at = |derivative| {
            let mut value = vec![0.0; self.y.len()];
            self.collocation.evaluate(&self.method, t, derivative, &mut value);
            value
        };
        let (y, y_dot) = (at(0), at(1));
        self.pause = Some(Pause { t, y, y_dot });
    }
}

//! Interface of the run driver to a time integrator, implemented for IDAS and Radau IIA.

use myovib_fem::Inverted;
use myovib_radau::RadauState;
use serde::{Deserialize, Serialize};
use sundials_wrap as wrap;

use crate::error::ModelError;
use crate::integration::statistics::{Counts, EndReason};

/// Result of one internal step.
#[derive(Debug, Clone, PartialEq)]
pub enum Advance {
    /// A step was accepted; the end time is not yet reached.
    Stepped,
    /// The end time is reached.
    Finished,
    /// The integrator gave up.
    Stopped {
        /// The cause.
        reason: EndReason,
        /// Description of the cause, with time, step size, order, and components with the largest errors.
        message: String,
        /// An element that was inverted in attempts at the failed step.
        inverted: Option<Inverted>,
    },
}

/// Data from which a run with Radau IIA can be continued with bitwise identical results.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Continuation {
    /// The integrator's state.
    pub(crate) radau: RadauState,
    /// Whether the last step was shortened.
    pub(crate) shortened: bool,
    /// Counts up to the last jump.
    #[serde(default)]
    pub(crate) before: Counts,
    /// Data of separately integrated oscillators.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) chains: Option<Box<Continuation>>,
}

/// A variable-step integrator that owns its problem.
pub trait Integrator<P> {
    /// If the excitation jumps at the current time, restarts the integration from a state that is consistent with the
    /// values after the jump. [`advance`] does this automatically. Call this method before [`advance`] to access the
    /// start of the next step.
    ///
    /// [`advance`]: Integrator::advance
    ///
    /// # Errors
    /// Returns an error if no consistent state is found.
    fn pass_jump(&mut self) -> Result<(), ModelError>;

    /// Takes one internal step, at most to the end time.
    ///
    /// # Errors
    /// Returns an error if the integrator is misused or the problem fails fatally. If the integrator gives up, the
    /// result is [`Advance::Stopped`] instead.
    fn advance(&mut self) -> Result<Advance, ModelError>;

    /// Returns the time reached, s.
    fn time(&self) -> f64;

    /// Evaluates the solution, or its derivative of the given order, at a time within the last
    /// step.
    ///
    /// # Errors
    /// Returns an error if `t` is outside the last step or the order is too high.
    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError>;

    /// Returns the times (s) within the last step at which the dense output changes from one polynomial to another.
    fn inner_ends(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Writes an estimate of the error that the last step adds to the solution to `out`, without evaluating the
    /// problem. Returns false if the integrator has no such estimate. This applies to Radau IIA, whose estimates have
    /// a lower order than its error.
    ///
    /// # Errors
    /// Returns an error if `out` has the wrong length.
    fn local_error(&mut self, _out: &mut [f64]) -> Result<bool, ModelError> {
        Ok(false)
    }

    /// Returns the accumulated counts.
    fn counts(&self) -> Counts;

    /// Returns the data from which [`restore`](Integrator::restore) continues with bitwise identical results, or
    /// `None` for BDF, because IDAS does not expose its history.
    fn save(&self) -> Option<Continuation> {
        None
    }

    /// Continues from the state that an integrator with the same problem and settings saved. BDF ignores the state.
    ///
    /// # Errors
    /// Returns an error if the state belongs to another problem, or if the matrices cannot be recomputed.
    fn restore(&mut self, _continuation: &Continuation) -> Result<(), ModelError> {
        Ok(())
    }

    /// Returns the problem.
    fn problem(&self) -> &P;

    /// Returns the problem for evaluations outside the time integration.
    fn problem_mut(&mut self) -> &mut P;
}

/// Forwards methods of an [`Integrator`] to the wrapped integrator `inner`.
macro_rules! forward_to_inner {
    ($problem:ty) => {
        fn pass_jump(&mut self) -> Result<(), $crate::error::ModelError> {
            self.inner.pass_jump()
        }

        fn time(&self) -> f64 {
            self.inner.time()
        }

        fn dense_output(
            &mut self,
            t: f64,
            derivative: u32,
            out: &mut [f64],
        ) -> Result<(), $crate::error::ModelError> {
            self.inner.dense_output(t, derivative, out)
        }

        fn local_error(&mut self, out: &mut [f64]) -> Result<bool, $crate::error::ModelError> {
            self.inner.local_error(out)
        }

        fn counts(&self) -> $crate::integration::statistics::Counts {
            self.inner.counts()
        }

        fn problem(&self) -> &$problem {
            self.inner.problem()
        }

        fn problem_mut(&mut self) -> &mut $problem {
            self.inner.problem_mut()
        }
    };
}
pub(crate) use forward_to_inner;

impl Advance {
    /// Converts the outcome of a solver that integrates to `t_end`.
    pub(crate) fn of(outcome: wrap::Outcome, t_end: f64) -> Self {
        match outcome {
            wrap::Outcome::Stopped(mut stop) => {
                // The model gives more specific advice.
                stop.remedies.clear();
                let worst: Vec<_> = stop
                    .worst_components
                    .iter()
                    .take(3)
                    .map(|w| match w.weighted_error {
                        error if error < 1e6 => format!("{} ({error:.1})", w.name),
                        error => format!("{} ({error:.1e})", w.name),
                    })
                    .collect();
                let mut message = stop.to_string();
                if !worst.is_empty() {
                    message += "; largest weighted errors: ";
                    message += &worst.join(", ");
                }
                Advance::Stopped { reason: reason(stop.reason), message, inverted: None }
            }
            outcome if outcome.t() >= t_end => Advance::Finished,
            _ => Advance::Stepped,
        }
    }
}

/// Converts a solver's reason to an [`EndReason`].
fn reason(reason: wrap::StopReason) -> EndReason {
    use wrap::StopReason as Ida;
    match reason {
        Ida::ErrorTestFailures | Ida::ToleranceTooTight | Ida::ErrorWeightsFailed => {
            EndReason::ErrorTestFailures
        }
        Ida::ConvergenceFailures | Ida::ConstraintsViolated => EndReason::ConvergenceFailures,
        Ida::StepTooSmall => EndReason::StepTooSmall,
        Ida::LinearSetupFailed | Ida::LinearSolveFailed => EndReason::LinearSetupFailed,
        Ida::MaxSteps => EndReason::MaxSteps,
        // A function of the problem failed; the message names it.
        _ => EndReason::ResidualFailed,
    }
}

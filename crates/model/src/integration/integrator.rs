//! What the run driver asks of a time integrator, IDAS or Radau IIA, and what both answer.

use myovib_fem::Inverted;
use myovib_radau::RadauState;
use serde::{Deserialize, Serialize};
use sundials_wrap as wrap;

use crate::error::ModelError;
use crate::integration::statistics::{Counts, StopReason};

/// What one internal step came to.
#[derive(Debug, Clone, PartialEq)]
pub enum Advance {
    /// A step was accepted; the end time is not reached.
    Stepped,
    /// The end time is reached.
    Finished,
    /// The integrator gave up.
    Stopped {
        /// The cause.
        reason: StopReason,
        /// The cause in words: time, step size, order, the components at fault.
        message: String,
        /// An element that attempts at the step not taken have turned inside out.
        inverted: Option<Inverted>,
    },
}

/// From where a run by Radau IIA goes on bit by bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Continuation {
    /// The integrator's state.
    pub(crate) radau: RadauState,
    /// Whether its last step was shortened.
    pub(crate) shortened: bool,
    /// The counts up to the last jump.
    #[serde(default)]
    pub(crate) before: Counts,
}

/// A variable-step integrator that owns its problem.
pub trait Integrator<P> {
    /// Goes behind a jump of what drives the system, if the time reached is that of one: the state is
    /// made consistent with the right values, and the method starts anew. [`advance`] does so first;
    /// called before, it tells when its step starts.
    ///
    /// [`advance`]: Integrator::advance
    ///
    /// # Errors
    /// No consistent state.
    fn pass_jump(&mut self) -> Result<(), ModelError>;

    /// Takes one internal step, at most to the end time.
    ///
    /// # Errors
    /// Misuse and fatal errors of the problem; giving up is [`Advance::Stopped`].
    fn advance(&mut self) -> Result<Advance, ModelError>;

    /// The time reached, s.
    fn time(&self) -> f64;

    /// The solution, or its derivative of the given order, at a time within the last step.
    ///
    /// # Errors
    /// If `t` is outside the last step or the order is too high.
    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError>;

    /// Writes the integrator's estimate of the error of the last step to `out`. It costs no evaluation of
    /// the problem.
    ///
    /// # Errors
    /// If `out` has the wrong length.
    fn local_error(&mut self, out: &mut [f64]) -> Result<(), ModelError>;

    /// What the last step adds to the error of a quantity that vibrates, and the error of dense output
    /// within it, both per what [`local_error`](Integrator::local_error) says of the quantity, which is
    /// `relative` times the size of the vibration.
    fn errors_per_estimate(&self, relative: f64) -> [f64; 2];

    /// The counts so far.
    fn counts(&self) -> Counts;

    /// What [`restore`](Integrator::restore) needs to take the steps that would follow, bit by bit;
    /// `None` with BDF, whose past steps IDAS does not give.
    fn save(&self) -> Option<Continuation> {
        None
    }

    /// Goes on from where an integrator of the same problem and settings was; BDF goes on as it is.
    ///
    /// # Errors
    /// The state of another problem; matrices that cannot be computed again.
    fn restore(&mut self, _continuation: &Continuation) -> Result<(), ModelError> {
        Ok(())
    }

    /// The problem.
    fn problem(&self) -> &P;

    /// The problem, for evaluations beside the integration.
    fn problem_mut(&mut self) -> &mut P;
}

/// What an [`Integrator`] around another, its `inner`, leaves to it.
macro_rules! left_to_inner {
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

        fn local_error(&mut self, out: &mut [f64]) -> Result<(), $crate::error::ModelError> {
            self.inner.local_error(out)
        }

        fn errors_per_estimate(&self, relative: f64) -> [f64; 2] {
            self.inner.errors_per_estimate(relative)
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
pub(crate) use left_to_inner;

impl Advance {
    /// What a step of a solver on its way to `t_end` came to.
    pub(crate) fn of(outcome: wrap::Outcome, t_end: f64) -> Self {
        match outcome {
            wrap::Outcome::Stopped(mut stop) => {
                // What helps a muscle is known better here.
                stop.remedy = None;
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
                Advance::Stopped {
                    reason: reason(stop.reason),
                    message,
                    inverted: None,
                }
            }
            outcome if outcome.t() >= t_end => Advance::Finished,
            _ => Advance::Stepped,
        }
    }
}

/// The wrapper's reasons under the names all integrators share.
fn reason(reason: wrap::StopReason) -> StopReason {
    use wrap::StopReason as Ida;
    match reason {
        Ida::ErrorTestFailures | Ida::ToleranceTooTight | Ida::ErrorWeightsFailed => {
            StopReason::ErrorTestFailures
        }
        Ida::ConvergenceFailures | Ida::ConstraintsViolated => StopReason::ConvergenceFailures,
        Ida::StepTooSmall => StopReason::StepTooSmall,
        Ida::LinearSetupFailed | Ida::LinearSolveFailed => StopReason::LinearSetupFailed,
        Ida::MaxSteps => StopReason::MaxSteps,
        // A function of the problem: the message says which.
        _ => StopReason::ResidualFailed,
    }
}

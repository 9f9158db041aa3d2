//! One attempt at a step: Jacobian, set-up, Newton, error test.

use sundials_wrap::{DaeProblem, StepError, StopReason};

use super::RadauSolver;
use crate::error::RadauError;
use crate::matrices::NewtonMatrices;
use crate::newton::{Newton, Step};
use crate::options::StepSize;

/// Where the Jacobian in use was evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Jacobian {
    /// Nowhere that serves: it is due.
    Due,
    /// At an earlier step.
    Old,
    /// At the beginning of this step.
    Current,
}

/// What one attempt at a step led to.
pub(super) enum Attempt {
    Accepted { proposal: f64 },
    Rejected(Rejection),
}

/// Why an attempt was rejected, and the factor on h for the next one.
pub(super) struct Rejection {
    pub(super) reason: StopReason,
    pub(super) message: String,
    pub(super) step_factor: f64,
}

/// What cannot be repaired by a smaller step.
pub(super) struct Fatal {
    pub(super) function: &'static str,
    pub(super) source: Box<dyn std::error::Error + Send + Sync>,
}

impl Fatal {
    /// The error of a step of size `h` from `t`.
    pub(super) fn in_step(self, t: f64, h: f64) -> RadauError {
        let Self { function, source } = self;
        RadauError::Fatal {
            function,
            t,
            h,
            source,
        }
    }
}

/// Halves the step after a recoverable error, ends the integration after a fatal one.
fn rejection(
    function: &'static str,
    reason: StopReason,
    error: StepError,
) -> Result<Rejection, Fatal> {
    match error {
        StepError::Recoverable(message) => Ok(Rejection {
            reason,
            message,
            step_factor: 0.5,
        }),
        StepError::Fatal(source) => Err(Fatal { function, source }),
    }
}

impl<P: DaeProblem, M: NewtonMatrices<P>> RadauSolver<P, M> {
    /// One attempt at a step of size h; nothing but Newton's memory and the Jacobian changes.
    pub(super) fn attempt(&mut self, h: f64, repeated: bool) -> Result<Attempt, Fatal> {
        let iterations = match self.solve_stages(h)? {
            Ok(iterations) => iterations,
            Err(rejection) => return Ok(Attempt::Rejected(rejection)),
        };
        if let StepSize::Fixed(proposal) = self.options.step_size {
            return Ok(Attempt::Accepted { proposal });
        }
        let first = self.counters.stats.steps == 0;
        let (step, counters) = (
            Step {
                method: &self.method,
                t: self.t,
                h,
                y: &self.y,
                weights: self.weights.scaled(),
            },
            &mut self.counters,
        );
        let (problem, matrices, z) = (&mut self.problem, &mut self.matrices, &self.newton.z);
        let filter_twice = first || repeated;
        match self
            .error_test
            .estimate(problem, matrices, &step, z, filter_twice, counters)
        {
            Ok(error) if error < 1.0 => Ok(Attempt::Accepted {
                proposal: self.control.accept(h, error, iterations),
            }),
            Ok(error) if !error.is_finite() => Ok(Attempt::Rejected(Rejection {
                reason: StopReason::LinearSolveFailed,
                message: format!("the estimated error is {error} at h = {h:e}"),
                step_factor: 0.5,
            })),
            Ok(error) => Ok(Attempt::Rejected(Rejection {
                reason: StopReason::ErrorTestFailures,
                message: format!("estimated error {error:.2e} times the tolerance at h = {h:e}"),
                // Nothing is known about the scale before the first step is accepted.
                step_factor: match first {
                    true => 0.1,
                    false => self.control.propose(h, error, iterations) / h,
                },
            })),
            Err(error) => {
                rejection("residual", StopReason::ResidualFailed, error).map(Attempt::Rejected)
            }
        }
    }

    /// Solves the stage equations, with a new Jacobian if the one at hand fails; the number of
    /// iterations, or why it could not be done.
    fn solve_stages(&mut self, h: f64) -> Result<Result<usize, Rejection>, Fatal> {
        self.weights.scale(h);
        loop {
            if let Err(error) = self.evaluate_jacobian() {
                return rejection("Jacobian", StopReason::ResidualFailed, error).map(Err);
            }
            if let Err(error) = self.set_up(h) {
                return rejection("linear set-up", StopReason::LinearSetupFailed, error).map(Err);
            }
            let z = &mut self.newton.z;
            let (method, last) = (&self.method, &self.collocation);
            self.predictor.start(method, last, (self.t, h), &self.y, z);
            let step = Step {
                method: &self.method,
                t: self.t,
                h,
                y: &self.y,
                weights: self.weights.scaled(),
            };
            let (problem, matrices) = (&mut self.problem, &mut self.matrices);
            let rejection = match self
                .newton
                .solve(problem, matrices, &step, &mut self.counters)
            {
                Ok(Newton::Converged { iterations }) => return Ok(Ok(iterations)),
                Ok(Newton::Failed { step_factor }) => Rejection {
                    reason: StopReason::ConvergenceFailures,
                    message: format!("Newton does not converge at h = {h:e}"),
                    step_factor,
                },
                Err(error) => rejection("residual", StopReason::ResidualFailed, error)?,
            };
            self.counters.stats.newton_failures += 1;
            // The Jacobian of an earlier step may be to blame for slow convergence.
            if self.jacobian == Jacobian::Current || rejection.reason == StopReason::ResidualFailed
            {
                return Ok(Err(rejection));
            }
            self.jacobian = Jacobian::Due;
        }
    }

    /// Evaluates the Jacobian at the beginning of the step, if it is due.
    fn evaluate_jacobian(&mut self) -> Result<(), StepError> {
        if self.jacobian == Jacobian::Due {
            self.counters.stats.jacobian_evaluations += 1;
            self.set_up_for = None;
            self.matrices
                .evaluate(&mut self.problem, self.t, &self.y, &self.y_dot)?;
            self.jacobian = Jacobian::Current;
        }
        Ok(())
    }

    /// Sets up J_y + λ/h J_ẏ for all eigenvalues λ of A⁻¹, if h or the Jacobian is new.
    fn set_up(&mut self, h: f64) -> Result<(), StepError> {
        if self.set_up_for == Some(h) {
            return Ok(());
        }
        self.set_up_for = None;
        self.counters.stats.linear_setups += 1;
        self.counters.work.real_factorizations += 1;
        self.counters.work.complex_factorizations += self.shifts.len() as u64;
        for (shift, mode) in self.shifts.iter_mut().zip(self.method.complex_modes()) {
            *shift = mode.lambda / h;
        }
        let real = self.method.real_mode().lambda / h;
        self.matrices
            .set_up(&mut self.problem, real, &self.shifts)?;
        self.set_up_for = Some(h);
        Ok(())
    }
}

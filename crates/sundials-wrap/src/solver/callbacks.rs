//! Safe side of the interface to C: the problem, the user functions, and a record of their failures.

use super::registered::{RegisteredProblem, Repeating};
use super::sensitivity::SensitivityEquations;
use crate::error::Error;
use crate::ffi::callbacks::{Answer, Callbacks, Convergence, NewtonIterate};
use crate::vector_kernels::{is_finite, is_positive};
use myovib_dae::{Linearization, Problem, StepError, StopReason, Tolerances};

use super::linear::Linear;
use super::newton::NewtonTest;
use super::within::WithinStep;
use super::zeros::ZeroSides;

/// Root functions g(t, y, ẏ), or the integrands of quadratures; writes to the last argument.
pub(super) type Function<P> =
    dyn FnMut(&mut P, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError> + Send;
/// Function that writes ∂r/∂y S + ∂r/∂ẏ Ṡ + ∂r/∂p_j for the integrand r of a quadrature to the last argument. The other
/// arguments are j, (t, y, ẏ) and (S, Ṡ).
pub(super) type QuadratureSensitivities<P> = dyn FnMut(&mut P, usize, (f64, &[f64], &[f64]), [&[f64]; 2], &mut [f64]) -> Result<(), StepError>
    + Send;
/// Function that writes the error weights for y to the last argument.
pub(super) type Weights<P> = dyn FnMut(&mut P, &[f64], &mut [f64]) -> Result<(), StepError> + Send;

/// Source of the error weights.
pub(super) enum Weighing<P> {
    /// 1/(rtol |y| + atol)
    Tolerances(Tolerances),
    /// A user function.
    Function(Box<Weights<P>>),
}

impl<P: Problem> Weighing<P> {
    /// Returns weights for distances between states, given the error weights.
    pub(super) fn distance(&self, weights: &[f64]) -> Vec<f64> {
        match self {
            Self::Tolerances(tolerances) => tolerances.distance(weights),
            Self::Function(_) => weights.to_vec(),
        }
    }

    /// Writes the error weights at `y`.
    pub(super) fn write(
        &mut self,
        problem: &mut P,
        y: &[f64],
        weights: &mut [f64],
    ) -> Result<(), StepError> {
        match self {
            Self::Tolerances(tolerances) => tolerances.write_weights(y, weights),
            Self::Function(function) => function(problem, y, weights)?,
        }
        if is_positive(weights) {
            return Ok(());
        }
        match weights.iter().position(|&w| !(w > 0.0 && w.is_finite())) {
            None => Ok(()),
            Some(i) => {
                let (weight, value, name) = (weights[i], y[i], problem.component_name(i));
                Err(StepError::Recoverable(match self {
                    Self::Tolerances(_) => format!(
                        "the tolerance of {name} is zero at {name} = {value}: it needs an absolute \
                         tolerance > 0"
                    ),
                    Self::Function(_) => format!("error weight[{i}] = {weight} must be positive"),
                }))
            }
        }
    }
}

/// The problem and all other user functions that may be called by IDAS.
pub(super) struct UserFunctions<P> {
    pub(super) problem: P,
    pub(super) n_roots: usize,
    pub(super) roots: Option<Box<Function<P>>>,
    pub(super) zeros: ZeroSides,
    pub(super) weighing: Weighing<P>,
    /// Error weights of y that IDAS uses; with sensitivities, the weights at the last linearization.
    pub(super) weights: Vec<f64>,
    pub(super) quadrature: Option<Box<Function<P>>>,
    pub(super) linear: Linear<P>,
    pub(super) newton: NewtonTest,
    /// Search for inputs within steps, if requested.
    pub(super) within: Option<WithinStep>,
    pub(super) sensitivities: Option<SensitivityEquations<P>>,
    /// Function that writes the time derivatives of the sensitivities of the quadratures.
    pub(super) quadrature_sensitivities: Option<Box<QuadratureSensitivities<P>>>,
    pub(super) backward: Vec<RegisteredProblem<P>>,
    pub(super) repeating: Repeating,
    pub(super) repetitions: Repetitions,
    /// Time of the last call with a time argument, used in messages about calls without one.
    pub(super) t_called: f64,
    pub(super) failures: FailureLog,
}

/// Ratio of the displacements of difference quotients near a kink to the usual displacements.
const FINE: f64 = 1e-4;

/// Number of times that a step was repeated with a smaller size after a failure. A repetition is detected if a matrix
/// is set up at an earlier time than before.
pub(super) struct Repetitions {
    count: usize,
    t: f64,
    /// Latest time of a repeated step.
    t_failed: f64,
}

impl Repetitions {
    /// Returns the counter for an integration from `t0`.
    pub(super) fn from(t0: f64) -> Self {
        Self { count: 0, t: t0, t_failed: t0 }
    }

    fn count(&mut self, t: f64, step: f64) {
        let is_later = |than: f64| (t - than) * step > 0.0;
        if (self.t - t) * step > 0.0 {
            if self.count == 0 {
                self.t_failed = self.t;
            }
            self.count += 1;
        } else if is_later(self.t_failed) || (!self.suggest_kink() && is_later(self.t)) {
            self.count = 0;
        }
        self.t = t;
    }

    /// Returns whether a step has failed so often that F may have a kink near it. Displacements as large as the
    /// tolerances might then cross the kink.
    fn suggest_kink(&self) -> bool {
        self.count > 2
    }

    /// Returns 1 and −1 alternately.
    fn alternate(&self) -> f64 {
        if self.count.is_multiple_of(2) { 1.0 } else { -1.0 }
    }
}

/// Failures since the beginning of the last call, reported when the call ends.
#[derive(Default)]
pub(super) struct FailureLog {
    /// Fatal error of a user function.
    pub(super) fatal: Option<Error>,
    /// Last recoverable error, for the message if IDAS gives up.
    pub(super) recoverable: Option<String>,
    /// Function that returned the recoverable error.
    pub(super) function: Option<&'static str>,
    /// Last message of IDAS.
    pub(super) message: Option<String>,
}

impl FailureLog {
    /// Converts the `result` of a function to the return code that IDAS expects, and records a failure. A result is successful only if
    /// all `values` are finite.
    pub(super) fn answer(
        &mut self,
        function: &'static str,
        t: f64,
        result: Result<(), StepError>,
        values: &[f64],
    ) -> Answer {
        match result {
            Ok(()) => match first_not_finite(values) {
                None => Answer::Success,
                Some((i, value)) => {
                    self.function = Some(function);
                    self.recoverable = Some(format!("{function}[{i}] = {value} at t = {t}"));
                    Answer::Recoverable
                }
            },
            Err(StepError::Recoverable(reason)) => {
                self.function = Some(function);
                self.recoverable = Some(format!("{function} at t = {t}: {reason}"));
                Answer::Recoverable
            }
            Err(error) => {
                let source = match error {
                    StepError::Fatal(source) => source,
                    other => other.into(),
                };
                self.fatal = Some(Error::Callback { function, t, source });
                Answer::Fatal
            }
        }
    }

    /// Returns the actual reason for a failure. IDAS reports all these failures as failures of Newton's method.
    pub(super) fn culprit(&self) -> Option<StopReason> {
        match self.function.filter(|_| self.recoverable.is_some())? {
            "Jacobian" => Some(StopReason::JacobianFailed),
            "linear setup" => Some(StopReason::LinearSetupFailed),
            "linear solve" => Some(StopReason::LinearSolveFailed),
            _ => None,
        }
    }

    /// Returns the message of IDAS and the message of the function that failed.
    pub(super) fn take_message(&mut self) -> String {
        let parts = [self.message.take(), self.recoverable.take()];
        parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
    }
}

/// Returns the first of the `values` that is infinite or NaN. In nearly all calls, a single pass with vector
/// instructions shows that all values are finite.
fn first_not_finite(values: &[f64]) -> Option<(usize, f64)> {
    if is_finite(values) {
        return None;
    }
    let mut numbered = values.iter().copied().enumerate();
    numbered.find(|(_, value)| !value.is_finite())
}

impl<P: Problem> UserFunctions<P> {
    /// Computes the weights of y at the state of the linearization if there are sensitivities. IDAS also calls the
    /// weight function for the sensitivities, without indicating this.
    fn weigh_at(&mut self, t: f64, y: &[f64]) -> Answer {
        if self.sensitivities.is_none() {
            return Answer::Success;
        }
        let weighed = self.weighing.write(&mut self.problem, y, &mut self.weights);
        let function = "error weight function";
        self.failures.answer(function, t, weighed, &[])
    }
}

impl<P: Problem> Callbacks for UserFunctions<P> {
    fn residual(&mut self, t: f64, y: &[f64], y_dot: &[f64], residual: &mut [f64]) -> Answer {
        self.t_called = t;
        if let Some(within) = &mut self.within {
            within.end_at(t, y, y_dot);
        }
        let result = self.problem.residual(t, y, y_dot, residual);
        self.failures.answer("residual", t, result, residual)
    }

    fn linear_setup(&mut self, t: f64, y: &[f64], y_dot: &[f64], c_j: f64) -> Answer {
        self.t_called = t;
        let weighed = self.weigh_at(t, y);
        if weighed != Answer::Success {
            return weighed;
        }
        let mut step = 1.0 / c_j;
        if let Some(sensitivities) = &mut self.sensitivities {
            sensitivities.step = step;
        }
        self.repetitions.count(t, step);
        let fine: Vec<f64>;
        let weights = match self.repetitions.suggest_kink() {
            true => {
                // Displacements are along or against the motion, and one of these directions does not cross the kink.
                step *= self.repetitions.alternate();
                fine = self.weights.iter().map(|w| w / FINE).collect();
                &fine
            }
            false => &self.weights,
        };
        let at = Linearization { t, y, y_dot, step, weights };
        let (evaluated, values) = self.linear.evaluate(&mut self.problem, &at, c_j);
        let evaluated = self.failures.answer("Jacobian", t, evaluated, values);
        if evaluated != Answer::Success {
            return evaluated;
        }
        let result = self.linear.set_up(&mut self.problem, c_j);
        self.failures.answer("linear setup", t, result, &[])
    }

    fn linear_solve(&mut self, rhs: &mut [f64]) -> Answer {
        let result = self.linear.solve(&mut self.problem, rhs);
        self.failures.answer("linear solve", self.t_called, result, rhs)
    }

    fn convergence(&mut self, iterate: &NewtonIterate) -> Convergence {
        let convergence = self.newton.judge(iterate);
        let is_predicted = iterate.number == 0 && convergence == Convergence::Converged;
        let Some(within) = self.within.as_mut().filter(|_| is_predicted) else {
            return convergence;
        };
        // F may be undefined within the step.
        match within.acts(&mut self.problem, &mut self.linear, &self.weights) {
            Ok(true) => {
                let message =
                    format!("an input acts during the step that ends at t = {}", self.t_called);
                (self.failures.recoverable, self.failures.function) = (Some(message), None);
                Convergence::Failed
            }
            _ => convergence,
        }
    }

    fn n_roots(&self) -> usize {
        self.n_roots
    }

    fn roots(&mut self, t: f64, y: &[f64], y_dot: &[f64], values: &mut [f64]) -> Answer {
        let Some(roots) = &mut self.roots else {
            return Answer::Fatal;
        };
        let result = roots(&mut self.problem, t, y, y_dot, values);
        let answer = self.failures.answer("root function", t, result, values);
        if matches!(answer, Answer::Success) {
            self.zeros.resolve(t, values);
        }
        answer
    }

    fn error_weights(&mut self, y: &[f64], weights: &mut [f64]) -> Answer {
        let result = self.weighing.write(&mut self.problem, y, weights);
        if self.sensitivities.is_none() {
            self.weights.copy_from_slice(weights);
        }
        if !self.repeating.has_room() {
            self.failures.fatal = Some(Error::NotRepeated { t: self.t_called });
            return Answer::Fatal;
        }
        self.failures.answer("error weight function", self.t_called, result, &[])
    }

    fn quadrature(&mut self, t: f64, y: &[f64], y_dot: &[f64], rates: &mut [f64]) -> Answer {
        let Some(quadrature) = &mut self.quadrature else {
            return Answer::Fatal;
        };
        let result = quadrature(&mut self.problem, t, y, y_dot, rates);
        self.failures.answer("quadrature", t, result, rates)
    }

    fn linearize(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Answer {
        let weighed = self.weigh_at(t, y);
        if weighed != Answer::Success {
            return weighed;
        }
        let Some(linearized) = &mut self.sensitivities else {
            return Answer::Fatal;
        };
        let step = linearized.step;
        let at = Linearization { t, y, y_dot, step, weights: &self.weights };
        let result = linearized.linearize(&mut self.problem, &at);
        self.failures.answer("Jacobian", t, result, &[])
    }

    fn sensitivity_residual(
        &mut self,
        j: usize,
        at: (f64, &[f64], &[f64]),
        s: [&[f64]; 2],
        residual: &mut [f64],
    ) -> Answer {
        let Some(linearized) = &mut self.sensitivities else {
            return Answer::Fatal;
        };
        let result = linearized.residual(&mut self.problem, j, at, s, residual);
        let function = "residual of a sensitivity";
        self.failures.answer(function, at.0, result, residual)
    }

    fn quadrature_sensitivity(
        &mut self,
        j: usize,
        at: (f64, &[f64], &[f64]),
        s: [&[f64]; 2],
        rates: &mut [f64],
    ) -> Answer {
        let Some(function) = &mut self.quadrature_sensitivities else {
            return Answer::Fatal;
        };
        let result = function(&mut self.problem, j, at, s, rates);
        let function = "sensitivity of a quadrature";
        self.failures.answer(function, at.0, result, rates)
    }

    fn message(&mut self, text: &str) {
        self.failures.message = Some(text.trim().to_owned());
    }
}

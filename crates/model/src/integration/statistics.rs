//! Counts and outcome of a run, with the names used in all output.

use std::fmt;

use myovib_dae::Statistics as Counters;
use myovib_fem::Inverted;
use myovib_radau::Work;
use serde::{Deserialize, Serialize};

/// Outcome of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The end time was reached.
    Finished,
    /// The integrator or the caller stopped the run before the end time.
    Stopped {
        /// The cause.
        reason: EndReason,
        /// Description of the cause, with numerical values.
        message: String,
        /// The element with an inverted quadrature point that stopped the integrator, if any. Scenes that end with
        /// [`EndReason::Inverted`], because of an inverted vertex, describe it in `inversion` of their document.
        inverted: Option<Inverted>,
    },
}

impl Outcome {
    /// Creates the outcome of a run ended by the caller.
    pub fn ended(reason: EndReason, message: String) -> Self {
        Self::Stopped { reason, message, inverted: None }
    }

    /// Returns `finished` or `stopped`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Stopped { .. } => "stopped",
        }
    }

    /// Returns the cause of a stop.
    pub fn reason(&self) -> Option<EndReason> {
        match self {
            Self::Finished => None,
            Self::Stopped { reason, .. } => Some(*reason),
        }
    }

    /// Returns the description of a stop.
    pub fn message(&self) -> Option<&str> {
        match self {
            Self::Finished => None,
            Self::Stopped { message, .. } => Some(message),
        }
    }
}

/// Reason why a run stopped before its end time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EndReason {
    /// The error test failed repeatedly or with the smallest step.
    ErrorTestFailures,
    /// Newton's method failed repeatedly or with the smallest step.
    ConvergenceFailures,
    /// The Newton matrix could not be factorized.
    LinearSetupFailed,
    /// The residual could not be evaluated.
    ResidualFailed,
    /// The step size underflowed.
    StepTooSmall,
    /// The limit on the number of steps was reached.
    MaxSteps,
    /// No equilibrium under the whole load was found.
    NoEquilibrium,
    /// Elements are inverted in the equilibrium.
    Inverted,
    /// The limit on CPU time or work was reached.
    WorkCap,
    /// Interrupted from outside.
    Interrupted,
    /// A stop condition of the scene was met.
    Event,
}

impl EndReason {
    /// Returns the name used in output.
    pub fn name(self) -> &'static str {
        match self {
            Self::ErrorTestFailures => "error_test_failures",
            Self::ConvergenceFailures => "convergence_failures",
            Self::LinearSetupFailed => "linear_setup_failed",
            Self::ResidualFailed => "residual_failed",
            Self::StepTooSmall => "step_too_small",
            Self::MaxSteps => "max_steps",
            Self::NoEquilibrium => "no_equilibrium",
            Self::Inverted => "inverted",
            Self::WorkCap => "work_cap",
            Self::Interrupted => "interrupted",
            Self::Event => "event",
        }
    }
}

impl fmt::Display for EndReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Counts of an integration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Counts {
    /// Accepted steps.
    pub steps: u64,
    /// Steps rejected by the error test (the paper's NRJ).
    pub error_test_failures: u64,
    /// Steps rejected because Newton's method failed (the paper's NCF).
    pub step_solve_failures: u64,
    /// All failures of Newton's method, including those resolved by a fresh Jacobian.
    pub newton_failures: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Residual evaluations.
    pub residual_evaluations: u64,
    /// Jacobian evaluations.
    pub jacobian_evaluations: u64,
    /// Setups of the linear solver (factorizations).
    pub linear_setups: u64,
    /// Order of the last step.
    pub last_order: u32,
    /// Size of the last step, s.
    pub last_step: f64,
    /// Linear algebra of Radau IIA; `None` for BDF.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radau_work: Option<Work>,
}

impl Counts {
    /// Adds the counts of the `later` part of an integration.
    #[must_use]
    pub fn followed_by(self, later: Self) -> Self {
        let last = if later.steps > 0 { later } else { self };
        Self {
            steps: self.steps + later.steps,
            error_test_failures: self.error_test_failures + later.error_test_failures,
            step_solve_failures: self.step_solve_failures + later.step_solve_failures,
            newton_failures: self.newton_failures + later.newton_failures,
            newton_iterations: self.newton_iterations + later.newton_iterations,
            residual_evaluations: self.residual_evaluations + later.residual_evaluations,
            jacobian_evaluations: self.jacobian_evaluations + later.jacobian_evaluations,
            linear_setups: self.linear_setups + later.linear_setups,
            radau_work: later.radau_work.map(|work| self.radau_work.unwrap_or_default() + work),
            last_order: last.last_order,
            last_step: last.last_step,
        }
    }
}

impl From<Counters> for Counts {
    fn from(stats: Counters) -> Self {
        Self {
            steps: stats.steps,
            error_test_failures: stats.error_test_failures,
            step_solve_failures: stats.step_solve_failures,
            newton_failures: stats.newton_failures,
            newton_iterations: stats.newton_iterations,
            residual_evaluations: stats.residual_evaluations,
            jacobian_evaluations: stats.jacobian_evaluations,
            linear_setups: stats.linear_setups,
            last_order: stats.last_order as u32,
            last_step: stats.last_step,
            radau_work: stats.work,
        }
    }
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// Counts of the integrator.
    pub counts: Counts,
    /// Time reached, s.
    pub t_reached: f64,
    /// Outcome of the run.
    pub outcome: Outcome,
    /// CPU time of the run, s.
    pub cpu_seconds: f64,
    /// Wall-clock time of the run, s.
    pub wall_seconds: f64,
}

//! Outcome of a call to the integrator.

use std::fmt;

use crate::linearization::Linearization;
use crate::problem::{Problem, VariableKind};
use crate::remedy::{Remedy, StopContext};
use crate::statistics::Statistics;
use crate::stop_reason::StopReason;
use crate::wrong_entry::{WrongEntry, check_jacobian};

/// Outcome of a call to the integrator. The solver's y and ẏ correspond to the time in the outcome.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Outcome {
    /// One step was taken.
    StepTaken {
        /// The time reached.
        t: f64,
    },
    /// The output time was reached.
    Reached {
        /// The output time.
        t: f64,
    },
    /// The stop time was reached.
    StopTime {
        /// The stop time.
        t: f64,
    },
    /// A root function crossed zero.
    Root {
        /// The time of the crossing.
        t: f64,
        /// For each root function: 1 for a rising crossing, −1 for a falling crossing, and 0 if it did not cross zero.
        crossings: Vec<i32>,
    },
    /// The integration cannot continue.
    Stopped(Box<Stop>),
}

impl Outcome {
    /// Returns the time reached.
    pub fn t(&self) -> f64 {
        match self {
            Self::StepTaken { t }
            | Self::Reached { t }
            | Self::StopTime { t }
            | Self::Root { t, .. } => *t,
            Self::Stopped(stop) => stop.t,
        }
    }
}

/// Diagnostic information about an integration that stopped early.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Stop {
    /// Reason for the stop.
    pub reason: StopReason,
    /// Message of the integrator. If a function of the problem failed, includes the message of that function.
    pub message: String,
    /// The time reached.
    pub t: f64,
    /// All counters, including the size and order of the last accepted step.
    pub statistics: Statistics,
    /// Components with the largest weighted local errors in the last attempt, in descending order.
    pub worst_components: Vec<WorstComponent>,
    /// Entry of the problem's Jacobian that seems to be wrong at the time reached.
    pub wrong_entry: Option<WrongEntry>,
    /// Suggested remedies, the most likely first; empty if none is known.
    pub remedies: Vec<Remedy>,
}

impl Stop {
    /// Creates the description of an integration that stopped at `t` for the given `reason`.
    pub fn new(
        reason: StopReason,
        message: String,
        t: f64,
        statistics: Statistics,
        worst_components: Vec<WorstComponent>,
    ) -> Self {
        let (wrong_entry, remedies) = (None, Vec::new());
        Self { reason, message, t, statistics, worst_components, wrong_entry, remedies }
    }

    /// Searches for a [wrong entry](check_jacobian) of the Jacobian if such an entry may have caused the stop by a
    /// failure of Newton's method. The search costs about 30 evaluations of the residual; it is omitted for more than
    /// 1000 unknowns.
    #[must_use]
    pub fn examined<P: Problem + ?Sized>(
        mut self,
        problem: &mut P,
        at: &Linearization<'_>,
    ) -> Self {
        let is_possible = matches!(
            self.reason,
            StopReason::ErrorTestFailures
                | StopReason::ConvergenceFailures
                | StopReason::StepTooSmall
                | StopReason::LinearSetupFailed
        );
        if is_possible && at.y.len() <= EXAMINED {
            self.wrong_entry = check_jacobian(problem, at).err();
        }
        self
    }

    /// Adds suggested remedies for an integration of `problem`. `kinds` contains the kinds of its variables, and
    /// `highest` is the highest index that the method supports with the current settings.
    #[must_use]
    pub fn advised(mut self, problem: &impl Problem, kinds: &[VariableKind], highest: u8) -> Self {
        let context = StopContext::of(problem, kinds, self.statistics.steps);
        self.remedies = context.remedies(self.reason, highest);
        self
    }
}

/// Maximum number of unknowns for which the Jacobian is examined after a stop. The limit is low, because the default
/// pattern is full.
const EXAMINED: usize = 1000;

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { reason, message, t, statistics, wrong_entry, remedies, .. } = self;
        let Statistics { steps, last_step, last_order, .. } = statistics;
        write!(
            f,
            "stopped at t = {t} after {steps} steps (last step {last_step:e}, order \
             {last_order}): {reason}: {message}"
        )?;
        if let Some(wrong) = wrong_entry {
            write!(f, "; {wrong}")?;
        }
        for (i, remedy) in remedies.iter().enumerate() {
            let before = if i == 0 { "; suggested remedy:" } else { "; or" };
            write!(f, "{before} {remedy}")?;
        }
        Ok(())
    }
}

/// A component and its local error.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct WorstComponent {
    /// Index of the component.
    pub index: usize,
    /// Name from [`Problem::component_name`].
    pub name: String,
    /// Estimated local error times the error weight; 1 corresponds to the tolerance.
    pub weighted_error: f64,
}

/// Maximum length of [`Stop::worst_components`].
const N_WORST: usize = 8;

impl WorstComponent {
    /// Returns the components with the largest weighted errors for [`Stop::worst_components`]. `of_all` contains the
    /// weighted errors of all components.
    pub fn largest(
        problem: &impl Problem,
        of_all: impl IntoIterator<Item = f64>,
    ) -> Vec<WorstComponent> {
        let mut ranked: Vec<_> = of_all.into_iter().map(f64::abs).enumerate().collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked.truncate(N_WORST);
        let named = |(index, weighted_error)| WorstComponent {
            index,
            name: problem.component_name(index),
            weighted_error,
        };
        ranked.into_iter().map(named).collect()
    }
}

//! How a call of the integrator ended.

use std::fmt;

use crate::problem::{Problem, VariableKind};
use crate::remedy::Standing;
use crate::statistics::Statistics;
use crate::stop_reason::StopReason;

/// How a call of the integrator ended. y and ẏ of the solver are those at the time named.
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
        /// For each root function 0 if it did not cross, 1 if it crossed rising, −1 if falling.
        crossings: Vec<i32>,
    },
    /// The integration cannot go on.
    Stopped(Box<Stop>),
}

impl Outcome {
    /// The time reached.
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

/// An integration that gave up, with all that helps to see why.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Stop {
    /// Why.
    pub reason: StopReason,
    /// The integrator's message and, if a function of the problem failed, its own.
    pub message: String,
    /// The time reached.
    pub t: f64,
    /// All counters, with the size and order of the last step accepted.
    pub statistics: Statistics,
    /// The components with the largest weighted local errors in the last attempt, largest first.
    pub worst_components: Vec<WorstComponent>,
    /// What may help, if that is known.
    pub remedy: Option<String>,
}

impl Stop {
    /// An integration that gave up at `t` for a `reason`.
    pub fn new(
        reason: StopReason,
        message: String,
        t: f64,
        statistics: Statistics,
        worst_components: Vec<WorstComponent>,
    ) -> Self {
        Self {
            reason,
            message,
            t,
            statistics,
            worst_components,
            remedy: None,
        }
    }

    /// With what may help an integration of `problem`, whose variables enter as `kinds` say, by a
    /// method that takes problems up to the index `highest` as they stand.
    #[must_use]
    pub fn advised(mut self, problem: &impl Problem, kinds: &[VariableKind], highest: u8) -> Self {
        let standing = Standing::of(problem, kinds, self.statistics.steps);
        self.remedy = standing.remedy(self.reason, highest);
        self
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            reason,
            message,
            t,
            statistics,
            remedy,
            ..
        } = self;
        let Statistics {
            steps,
            last_step,
            last_order,
            ..
        } = statistics;
        write!(
            f,
            "stopped at t = {t} after {steps} steps (last step {last_step:e}, order \
             {last_order}): {reason}: {message}"
        )?;
        match remedy {
            Some(remedy) => write!(f, "; what may help: {remedy}"),
            None => Ok(()),
        }
    }
}

/// A component and its share in the local error.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct WorstComponent {
    /// Its index.
    pub index: usize,
    /// Its name, from [`Problem::component_name`].
    pub name: String,
    /// Estimated local error times error weight: 1 is what the tolerance allows.
    pub weighted_error: f64,
}

/// How many components [`Stop::worst_components`] lists.
const N_WORST: usize = 8;

impl WorstComponent {
    /// The components with the largest of the weighted errors `of_all`, as
    /// [`Stop::worst_components`] lists them.
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

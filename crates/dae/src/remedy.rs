//! Suggested remedies for an integration that stopped.

use std::fmt;

use crate::problem::{Problem, VariableKind};
use crate::stop_reason::StopReason;

/// Highest index supported by Radau IIA.
const RADAU: u8 = 3;

/// Suggested remedy for an integration that stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// Call the integrator again.
    AnotherCall,
    /// Allow more steps.
    MoreSteps,
    /// Replace constraints by their derivatives, which lowers the index.
    LowerIndex,
    /// Exclude variables of index 2 from the error test.
    ExcludeIndex2,
    /// Start from values that satisfy the equations and the derivatives of the constraints.
    ConsistentStart,
    /// Restart at the time of a jump or kink of the equations, with the values after it.
    RestartAtBreak,
    /// Loosen all tolerances.
    LooserTolerances,
    /// Tighten all tolerances.
    TighterTolerances,
    /// Loosen the tolerances of velocities and multipliers, which Newton's method uses even if the error test does not.
    LooserMultipliers,
    /// State the constraints, and correct the initial values so that they are satisfied.
    StateConstraints,
    /// State the index of each variable.
    StateIndices,
    /// Use Radau IIA.
    Radau,
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AnotherCall => "another call, which continues",
            Self::MoreSteps => "a higher max_steps",
            Self::LowerIndex => {
                "replacing the constraint by its derivative, which lowers the index"
            }
            Self::ExcludeIndex2 => {
                "excluding variables of index 2 from the error test (Suppressed::FromIndex(2))"
            }
            Self::ConsistentStart => {
                "initial values that satisfy the equations (for index 1, call correct_initial_values) and, for an \
                 index above 1, the derivatives of the constraints"
            }
            Self::RestartAtBreak => {
                "integrating to the time at which an input or a characteristic jumps or has a kink, if such a time \
                 is near, and restarting there (reinit) with the values after it"
            }
            Self::LooserTolerances => "looser tolerances",
            Self::TighterTolerances => "tighter tolerances",
            Self::LooserMultipliers => {
                "looser tolerances for velocities and multipliers, which Newton's method also uses"
            }
            Self::StateConstraints => {
                "defining the constraints (Problem::constraints) and correcting the initial values by \
                 them"
            }
            Self::StateIndices => {
                "specifying the index of each variable (Problem::indices), if one is above 1"
            }
            Self::Radau => "Radau IIA, which supports indices up to 3 without changes",
        })
    }
}

/// Facts about a failed integration that, together with the reason, determine the remedies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StopContext {
    /// Highest variable index stated by the problem.
    index: Option<u8>,
    /// Whether there are algebraic variables.
    algebraic: bool,
    /// Whether the problem states its constraints.
    are_constraints_stated: bool,
    /// Number of steps accepted since the start.
    steps: u64,
}

impl StopContext {
    /// Collects these facts for an integration of `problem` after the given number of steps.
    pub(crate) fn of(problem: &impl Problem, kinds: &[VariableKind], steps: u64) -> Self {
        Self {
            index: problem.indices().and_then(|all| all.into_iter().max()),
            algebraic: kinds.contains(&VariableKind::Algebraic),
            are_constraints_stated: problem.n_constraints() > 0,
            steps,
        }
    }

    /// Returns the remedies for the given `reason`. `highest` is the highest index that the method supports with the
    /// current settings.
    pub(crate) fn remedies(self, reason: StopReason, highest: u8) -> Vec<Remedy> {
        let mut remedies = match reason {
            StopReason::MaxSteps => vec![Remedy::AnotherCall, Remedy::MoreSteps],
            StopReason::ToleranceTooTight => return vec![Remedy::LooserTolerances],
            StopReason::ErrorTestFailures
            | StopReason::ConvergenceFailures
            | StopReason::StepTooSmall
            | StopReason::LinearSetupFailed => self.against_failed_steps(reason, highest),
            _ => return Vec::new(),
        };
        if highest < RADAU {
            remedies.push(Remedy::Radau);
        }
        remedies
    }

    fn against_failed_steps(self, reason: StopReason, highest: u8) -> Vec<Remedy> {
        let mut remedies = Vec::new();
        let is_hidden = |index: u8| (2..=highest).contains(&index);
        let has_hidden_constraints = self.index.is_some_and(is_hidden);
        if self.index.is_some_and(|index| index > highest) {
            // Systems of index 2 may already contain the derivatives of constraints.
            remedies.push(match self.index {
                Some(2) => Remedy::ExcludeIndex2,
                _ => Remedy::LowerIndex,
            });
        } else {
            if self.steps == 0 {
                remedies.push(Remedy::ConsistentStart);
                if has_hidden_constraints && !self.are_constraints_stated {
                    remedies.push(Remedy::StateConstraints);
                }
            }
            // The minimum step size may be too large even if the initial values are consistent.
            if self.steps > 0 || reason == StopReason::StepTooSmall {
                remedies.extend([Remedy::RestartAtBreak, Remedy::LooserTolerances]);
                if has_hidden_constraints {
                    remedies.push(Remedy::LooserMultipliers);
                }
            }
        }
        if self.index.is_none() && self.algebraic {
            remedies.push(Remedy::StateIndices);
        }
        remedies
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: for the form of Gear, Gupta and Leimkuhler, replacing the constraint by its derivative was
    /// suggested.
    #[test]
    fn the_error_test_and_then_newton_tolerances_are_named_for_index_2() {
        use Remedy::{ExcludeIndex2, LooserMultipliers, LooserTolerances, Radau, RestartAtBreak};
        let context = StopContext {
            index: Some(2),
            algebraic: true,
            are_constraints_stated: false,
            steps: 1,
        };
        let failures = StopReason::ConvergenceFailures;
        assert_eq!(context.remedies(failures, 1), [ExcludeIndex2, Radau]);
        let excluded = [RestartAtBreak, LooserTolerances, LooserMultipliers, Radau];
        assert_eq!(context.remedies(failures, 2), excluded);
    }

    /// Regression test: remedies for inconsistent initial values were suggested after thousands of steps, and looser
    /// tolerances were suggested for initial values that violate a constraint.
    #[test]
    fn remedies_for_the_start_are_named_before_the_first_step_alone() {
        use Remedy::{
            ConsistentStart, LooserMultipliers, LooserTolerances, RestartAtBreak, StateConstraints,
        };
        let remedies = |reason, steps, are_constraints_stated| {
            let context =
                StopContext { index: Some(3), algebraic: true, are_constraints_stated, steps };
            context.remedies(reason, RADAU)
        };
        let failures = StopReason::ErrorTestFailures;
        let at_the_start = remedies(failures, 0, false);
        assert_eq!(at_the_start, [ConsistentStart, StateConstraints]);
        assert_eq!(remedies(failures, 0, true), [ConsistentStart]);
        let later = [RestartAtBreak, LooserTolerances, LooserMultipliers];
        assert_eq!(remedies(failures, 1, false), later);
        assert_eq!(remedies(failures, 1, true), later);
        let of_short_steps = remedies(StopReason::StepTooSmall, 0, true);
        assert_eq!(of_short_steps[0], ConsistentStart);
        assert_eq!(of_short_steps[1..], later);
    }
}

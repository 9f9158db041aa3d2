//! Suggested remedies for an integration that stopped.

use crate::problem::{Problem, VariableKind};
use crate::stop_reason::StopReason;

/// Highest index supported by Radau IIA.
const RADAU: u8 = 3;

/// Number of steps after which the size of the first step no longer matters: each step may be
/// eight times as long as the previous one.
const FIRST_STEPS: u64 = 10;

/// State of an integration that failed, in addition to the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StopContext {
    /// The highest index that the problem states of a variable.
    index: Option<u8>,
    /// Whether there are algebraic variables.
    algebraic: bool,
    /// Whether the problem states its constraints.
    are_constraints_stated: bool,
    /// Steps that were accepted since the start.
    steps: u64,
}

/// A remedy for mechanisms.
const CONSTRAINTS: &str = "stating the constraints (Problem::constraints) and correcting the initial \
                           values by them";

impl StopContext {
    /// Returns the state of an integration of `problem` after this number of steps.
    pub(crate) fn of(problem: &impl Problem, kinds: &[VariableKind], steps: u64) -> Self {
        Self {
            index: problem.indices().and_then(|all| all.into_iter().max()),
            algebraic: kinds.contains(&VariableKind::Algebraic),
            are_constraints_stated: problem.n_constraints() > 0,
            steps,
        }
    }

    /// Returns a remedy for this `reason`; `highest` is the highest index that the method supports
    /// directly.
    pub(crate) fn remedy(self, reason: StopReason, highest: u8) -> Option<String> {
        let mut remedies = match reason {
            StopReason::MaxSteps => vec!["another call, which goes on", "a higher max_steps"],
            StopReason::ToleranceTooTight => return Some("looser tolerances".to_owned()),
            StopReason::ErrorTestFailures
            | StopReason::ConvergenceFailures
            | StopReason::StepTooSmall
            | StopReason::LinearSetupFailed => self.against_failed_steps(highest),
            _ => return None,
        };
        if highest < RADAU {
            remedies.push("Radau IIA, which takes indices up to 3 as they stand");
        }
        Some(remedies.join("; or "))
    }

    fn against_failed_steps(self, highest: u8) -> Vec<&'static str> {
        let mut remedies = Vec::new();
        if self.index.is_some_and(|index| index > highest) {
            remedies.push("the derivative of the constraint in its place, which lowers the index");
        } else if self.steps == 0 {
            remedies.push(
                "values to start from that fulfill the equations (correct_initial_values) and, above \
                 index 1, the derivatives of the constraints",
            );
        } else {
            remedies.push(
                "integrating to the time where an input jumps or bends, if there is one near, and \
                 starting afresh from there (reinit)",
            );
            remedies.push("looser tolerances");
        }
        let is_hidden = |index: u8| (2..=highest).contains(&index);
        if self.index.is_some_and(is_hidden) {
            if self.steps <= FIRST_STEPS {
                remedies.push(
                    "a longer first step (initial_step), because short ones magnify what violates a \
                     constraint",
                );
            }
            remedies.push("looser tolerances for velocities and multipliers");
            if !self.are_constraints_stated {
                remedies.push(CONSTRAINTS);
            }
        }
        if self.index.is_none() && self.algebraic {
            remedies
                .push("stating the index of each variable (Problem::indices), if one is above 1");
        }
        remedies
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a different size of the first step was suggested after thousands of steps.
    #[test]
    fn a_longer_first_step_is_named_near_the_start_alone() {
        let printed = |steps| {
            let standing = StopContext {
                index: Some(3),
                algebraic: true,
                are_constraints_stated: steps % 2 == 1,
                steps,
            };
            standing.remedy(StopReason::StepTooSmall, RADAU).unwrap()
        };
        for (steps, is_named) in [(0, true), (FIRST_STEPS, true), (FIRST_STEPS + 1, false)] {
            let printed = printed(steps);
            assert_eq!(
                printed.contains("initial_step"),
                is_named,
                "{steps}: {printed}"
            );
            assert!(
                printed.contains("looser tolerances for velocities"),
                "{printed}"
            );
            let are_named = printed.contains("Problem::constraints");
            assert_eq!(are_named, steps % 2 == 0, "{steps}: {printed}");
        }
    }
}

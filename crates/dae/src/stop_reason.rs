//! Reasons why an integration stopped early.

use std::fmt;

/// Reason why an integration stopped early.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StopReason {
    /// The error test failed too often in one step.
    ErrorTestFailures,
    /// Newton's method failed too often in one step.
    ConvergenceFailures,
    /// A failure occurred at the smallest allowed step size, or the step was so small that t + h = t.
    StepTooSmall,
    /// The linear system could not be factorized.
    LinearSetupFailed,
    /// The linear system could not be solved.
    LinearSolveFailed,
    /// The residual could not be evaluated for any step size tried.
    ResidualFailed,
    /// The Jacobian could not be evaluated for any step size tried.
    JacobianFailed,
    /// The inequality constraints could not be satisfied.
    ConstraintsViolated,
    /// The limit on the number of steps per call was reached.
    MaxSteps,
    /// The tolerances are too tight for machine precision.
    ToleranceTooTight,
    /// The error weights could not be computed, or the tolerance of a component became zero.
    ErrorWeightsFailed,
    /// A root function could not be evaluated.
    RootFunctionFailed,
    /// The integrand of a quadrature could not be evaluated.
    QuadratureFailed,
    /// Another reason; see the message.
    Other,
}

impl StopReason {
    /// Returns the name used in reports: lower case with underscores.
    pub fn name(self) -> &'static str {
        match self {
            Self::ErrorTestFailures => "error_test_failures",
            Self::ConvergenceFailures => "convergence_failures",
            Self::StepTooSmall => "step_too_small",
            Self::LinearSetupFailed => "linear_setup_failed",
            Self::LinearSolveFailed => "linear_solve_failed",
            Self::ResidualFailed => "residual_failed",
            Self::JacobianFailed => "jacobian_failed",
            Self::ConstraintsViolated => "constraints_violated",
            Self::MaxSteps => "max_steps",
            Self::ToleranceTooTight => "tolerance_too_tight",
            Self::ErrorWeightsFailed => "error_weights_failed",
            Self::RootFunctionFailed => "root_function_failed",
            Self::QuadratureFailed => "quadrature_failed",
            Self::Other => "other",
        }
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::StopReason::{self, *};

    #[test]
    fn every_reason_has_a_unique_name() {
        let reasons: [StopReason; 14] = [
            ErrorTestFailures,
            ConvergenceFailures,
            StepTooSmall,
            LinearSetupFailed,
            LinearSolveFailed,
            ResidualFailed,
            JacobianFailed,
            ConstraintsViolated,
            MaxSteps,
            ToleranceTooTight,
            ErrorWeightsFailed,
            RootFunctionFailed,
            QuadratureFailed,
            Other,
        ];
        for reason in reasons {
            // Name of the variant in snake case.
            let words = format!("{reason:?}");
            let snake: String = words
                .char_indices()
                .flat_map(|(i, c)| {
                    let underscore = (i > 0 && c.is_uppercase()).then_some('_');
                    underscore.into_iter().chain(c.to_lowercase())
                })
                .collect();
            assert_eq!((reason.name(), reason.to_string()), (snake.as_str(), snake.clone()));
        }
    }
}

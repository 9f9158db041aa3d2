//! Step-size control: the classical proposal, limited by Gustafsson's prediction.

use myovib_dae::IntegratorError;
use myovib_dae::checks::{expect, expect_positive};
use serde::{Deserialize, Serialize};

/// Step-size control based on error estimates (Hairer & Wanner IV.8).
#[derive(Debug, Clone)]
pub(crate) struct Control {
    /// 1/(s + 1), because the estimate is of order s + 1.
    exponent: f64,
    safety: f64,
    newton_limit: usize,
    /// Ratio of the tolerance for the estimate to the tolerance for the solution, at least 1.
    loosened: f64,
    /// Lower bound for the expected estimate of a smooth solution.
    least_smooth: f64,
    history: StepHistory,
}

/// State stored between attempts.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct StepHistory {
    /// Step size and error of the last accepted step.
    accepted: Option<(f64, f64)>,
    /// Step size and error of the last rejected attempt at this step, if any.
    rejected: Option<(f64, f64)>,
}

impl StepHistory {
    /// Validates values that may come from a saved state.
    pub(crate) fn validate(&self) -> Result<(), IntegratorError> {
        for (h, error) in [self.accepted, self.rejected].into_iter().flatten() {
            expect_positive("step of the state", h)?;
            expect("error of the state", error, error >= 0.0, "at least 0")?;
        }
        Ok(())
    }
}

/// Limits for the factor by which the step size changes, as in RADAU5.
pub(crate) const FACTORS: (f64, f64) = (0.2, 8.0);

/// Lower bound for the errors used in predictions. Smaller estimates have no predictive value.
const LEAST_ERROR: f64 = 1e-10;

/// Lower bound for the previous error in Gustafsson's prediction, as in RADAU5.
const LEAST_TREND: f64 = 1e-2;

/// Lower bounds for the expected estimate of a smooth solution, without and with hidden constraints. Smaller estimates
/// are dominated by the remaining error of Newton's method, which hidden constraints amplify.
const LEAST_SMOOTH: [f64; 2] = [1e-3, 1e-2];

/// Range of orders that indicates a rough solution. If the solution is smooth, the estimate decreases as h^(s+1)
/// between attempts at a step. If a derivative of low order jumps within the step, the exponent of h is in this range.
/// If the estimate does not decrease, the initial values of the step contain errors.
const ROUGH_ORDERS: (f64, f64) = (0.5, 2.5);

/// Maximum growth of the estimate between steps for a smooth solution, apart from the growth caused by a change of the
/// step size.
const ROUGH_GROWTH: f64 = 10.0;

impl Control {
    pub(crate) fn new(
        stages: usize,
        safety: f64,
        newton_limit: usize,
        loosened: f64,
        constrained: bool,
    ) -> Self {
        Self {
            exponent: 1.0 / (stages as f64 + 1.0),
            safety,
            newton_limit,
            loosened: loosened.max(1.0),
            least_smooth: LEAST_SMOOTH[usize::from(constrained)],
            history: StepHistory::default(),
        }
    }

    /// Returns the state stored between attempts.
    pub(crate) fn history(&self) -> StepHistory {
        self.history
    }

    /// Restores the state returned by [`history`](Self::history).
    pub(crate) fn restore(&mut self, history: StepHistory) {
        self.history = history;
    }

    /// Sets the ratio of the tolerance for the estimate to the tolerance for the solution.
    pub(crate) fn set_loosened(&mut self, loosened: f64) {
        self.loosened = loosened.max(1.0);
    }

    /// Discards the history of previous steps.
    pub(crate) fn forget(&mut self) {
        self.history = StepHistory::default();
    }

    /// Returns the error that determines whether a step is accepted.
    ///
    /// The estimate, which has order s + 1, may exceed the tolerance for the solution, because the error of a smooth
    /// solution has order 2s. If the estimate does not behave as for a smooth solution, it is treated as the error and
    /// compared with the tolerance for the solution.
    pub(crate) fn judge(&self, h: f64, error: f64) -> f64 {
        let rough = match (self.history.rejected, self.history.accepted) {
            (Some((last_h, last_error)), _) => {
                let order = (last_error / error).ln() / (last_h / h).ln();
                (ROUGH_ORDERS.0..ROUGH_ORDERS.1).contains(&order)
            }
            (None, Some((last_h, last_error))) => {
                let expected = last_error * (h / last_h).powf(1.0 / self.exponent);
                error > ROUGH_GROWTH * expected.max(self.least_smooth)
            }
            (None, None) => false,
        };
        if rough { self.loosened * error } else { error }
    }

    /// Records a failed attempt and its estimate.
    pub(crate) fn reject(&mut self, h: f64, error: f64) {
        self.history.rejected = Some((h, error));
    }

    /// Returns the step size for which the error would be 1, reduced by a safety margin that grows with the number of
    /// Newton iterations.
    pub(crate) fn propose(&self, h: f64, error: f64, iterations: usize) -> f64 {
        let limit = 2.0 * self.newton_limit as f64;
        let safety = self.safety * (1.0 + limit) / (iterations as f64 + limit);
        let factor = safety.min(self.safety) * error.max(LEAST_ERROR).powf(-self.exponent);
        h * factor.clamp(FACTORS.0, FACTORS.1)
    }

    /// Returns the largest next step size that the error of the multipliers allows. `left` is the error that remains
    /// after the removal of the leading error, and is proportional to h^`order`.
    ///
    /// This error does not affect the current step, so the step is never repeated because of it.
    pub(crate) fn propose_for_multipliers(&self, h: f64, left: f64, order: i32) -> f64 {
        let exponent = -1.0 / f64::from(order.max(1));
        let factor = self.safety * left.max(LEAST_ERROR).powf(exponent);
        h * factor.clamp(FACTORS.0, FACTORS.1)
    }

    /// Returns the step size after an accepted step. It is the smaller of the classical proposal and Gustafsson's
    /// prediction from the trend of the errors, h_{n+1} = safety h_n (h_n/h_{n−1}) (err_{n−1}/err_n²)^(1/(s+1)).
    pub(crate) fn accept(&mut self, h: f64, error: f64, iterations: usize) -> f64 {
        let error = error.max(LEAST_ERROR);
        let mut proposal = self.propose(h, error, iterations);
        if let Some((last_h, last_error)) = self.history.accepted {
            let trend =
                (h / last_h) * (last_error.max(LEAST_TREND) / (error * error)).powf(self.exponent);
            proposal = proposal.min(h * (self.safety * trend).clamp(FACTORS.0, FACTORS.1));
        }
        self.history = StepHistory { accepted: Some((h, error)), rejected: None };
        proposal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_settle_where_the_estimate_meets_the_tolerance() {
        // err = (h/h*)⁴ for s = 3: the control must converge to safety · h*.
        let mut control = Control::new(3, 0.9, 7, 10.0, false);
        let mut h = 0.02;
        for _ in 0..50 {
            h = control.accept(h, (h / 0.1f64).powi(4), 1);
        }
        assert!((h - 0.09).abs() < 1e-3, "{h}");
    }

    #[test]
    fn factors_are_bounded_and_many_iterations_lower_the_step() {
        let control = Control::new(3, 0.9, 7, 10.0, false);
        assert_eq!(control.propose(1.0, 1e-30, 1), 8.0);
        assert_eq!(control.propose(1.0, 1e30, 1), 0.2);
        assert!(control.propose(1.0, 0.5, 7) < control.propose(1.0, 0.5, 1));
    }
}

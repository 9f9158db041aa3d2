//! Step size control: the classical proposal, tempered by Gustafsson's prediction.

use serde::{Deserialize, Serialize};

use crate::error::RadauError;
use crate::options::{expect, expect_positive};

/// Chooses step sizes from error estimates (Hairer & Wanner IV.8).
#[derive(Debug, Clone)]
pub(crate) struct Control {
    /// 1/(s + 1): the estimate is of order s + 1.
    exponent: f64,
    safety: f64,
    newton_limit: usize,
    /// The tolerance for the estimate over that for the solution, at least 1.
    loosened: f64,
    /// What the estimate of a smooth solution is expected to be at least.
    least_smooth: f64,
    memory: Memory,
}

/// What is kept between attempts.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Memory {
    /// Step and error of the last accepted step.
    accepted: Option<(f64, f64)>,
    /// Step and error of the last attempt at this step, if it was rejected.
    rejected: Option<(f64, f64)>,
}

impl Memory {
    /// Checks values that come from outside.
    pub(crate) fn validate(&self) -> Result<(), RadauError> {
        for (h, error) in [self.accepted, self.rejected].into_iter().flatten() {
            expect_positive("step of the state", h)?;
            expect("error of the state", error, error >= 0.0, "at least 0")?;
        }
        Ok(())
    }
}

/// A step is changed by a factor in this interval, as in RADAU5.
pub(crate) const FACTORS: (f64, f64) = (0.2, 8.0);

/// Estimates below this are taken as this: they say nothing about the next.
const LEAST_ERROR: f64 = 1e-10;

/// The trend of the errors starts from no smaller a one than this, as in RADAU5.
const LEAST_TREND: f64 = 1e-2;

/// What a smooth solution's estimate is expected to be at least, without and with hidden constraints:
/// smaller ones are of what Newton's method leaves, which these magnify.
const LEAST_SMOOTH: [f64; 2] = [1e-3, 1e-2];

/// Between attempts at a step the estimate of a smooth solution falls with h^(s+1); where a
/// derivative of low order jumps within the step, with a power in this interval. If it does not fall,
/// it is an error of the values the step begins with.
const ROUGH_ORDERS: (f64, f64) = (0.5, 2.5);

/// Of a smooth solution the estimate grows from step to step by no more than this factor beyond
/// the power of the steps' ratio.
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
            memory: Memory::default(),
        }
    }

    /// What is kept between attempts.
    pub(crate) fn memory(&self) -> Memory {
        self.memory
    }

    /// Goes on with this memory.
    pub(crate) fn restore(&mut self, memory: Memory) {
        self.memory = memory;
    }

    /// Sets the tolerance for the estimate over that for the solution.
    pub(crate) fn set_loosened(&mut self, loosened: f64) {
        self.loosened = loosened.max(1.0);
    }

    /// Forgets the steps before.
    pub(crate) fn forget(&mut self) {
        self.memory = Memory::default();
    }

    /// The error a step is judged by.
    ///
    /// The estimate of order s + 1 may exceed the tolerance for the solution because the error of a
    /// smooth one is of order 2s. Where the estimate does not behave as that of a smooth solution,
    /// it is the error, and held against the tolerance for the solution.
    pub(crate) fn judge(&self, h: f64, error: f64) -> f64 {
        let rough = match (self.memory.rejected, self.memory.accepted) {
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

    /// Takes note of an attempt that failed with this estimate.
    pub(crate) fn reject(&mut self, h: f64, error: f64) {
        self.memory.rejected = Some((h, error));
    }

    /// The step for which the error would be 1, less a safety margin that grows with the Newton
    /// iterations needed.
    pub(crate) fn propose(&self, h: f64, error: f64, iterations: usize) -> f64 {
        let limit = 2.0 * self.newton_limit as f64;
        let safety = self.safety * (1.0 + limit) / (iterations as f64 + limit);
        let factor = safety.min(self.safety) * error.max(LEAST_ERROR).powf(-self.exponent);
        h * factor.clamp(FACTORS.0, FACTORS.1)
    }

    /// The largest next step for what the removal of their leading error leaves in multipliers, of
    /// this order.
    ///
    /// It is no reason to repeat a step, which does not depend on it.
    pub(crate) fn propose_for_multipliers(&self, h: f64, left: f64, order: i32) -> f64 {
        let exponent = -1.0 / f64::from(order.max(1));
        let factor = self.safety * left.max(LEAST_ERROR).powf(exponent);
        h * factor.clamp(FACTORS.0, FACTORS.1)
    }

    /// The step to follow an accepted one: the smaller of the classical proposal and the one that
    /// continues the trend of the errors,
    /// h_{n+1} = safety h_n (h_n/h_{n−1}) (err_{n−1}/err_n²)^(1/(s+1)).
    pub(crate) fn accept(&mut self, h: f64, error: f64, iterations: usize) -> f64 {
        let error = error.max(LEAST_ERROR);
        let mut proposal = self.propose(h, error, iterations);
        if let Some((last_h, last_error)) = self.memory.accepted {
            let trend =
                (h / last_h) * (last_error.max(LEAST_TREND) / (error * error)).powf(self.exponent);
            proposal = proposal.min(h * (self.safety * trend).clamp(FACTORS.0, FACTORS.1));
        }
        self.memory = Memory {
            accepted: Some((h, error)),
            rejected: None,
        };
        proposal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_settle_where_the_estimate_meets_the_tolerance() {
        // err = (h/h*)⁴ for s = 3: the control must end at safety · h*.
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

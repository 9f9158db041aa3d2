//! Step size control: the classical proposal, tempered by Gustafsson's prediction.

/// Chooses step sizes from error estimates (Hairer & Wanner IV.8).
#[derive(Debug, Clone)]
pub(crate) struct Control {
    /// 1/(s + 1): the estimate is of order s + 1.
    exponent: f64,
    safety: f64,
    newton_limit: usize,
    /// Step and error of the last accepted step.
    accepted: Option<(f64, f64)>,
}

/// A step is changed by a factor in this interval, as in RADAU5.
const FACTORS: (f64, f64) = (0.2, 8.0);

/// Estimates below this are taken as this: they say nothing about the next.
const LEAST_ERROR: f64 = 1e-10;

/// The trend of the errors starts from no smaller a one than this, as in RADAU5.
const LEAST_TREND: f64 = 1e-2;

impl Control {
    pub(crate) fn new(stages: usize, safety: f64, newton_limit: usize) -> Self {
        Self {
            exponent: 1.0 / (stages as f64 + 1.0),
            safety,
            newton_limit,
            accepted: None,
        }
    }

    /// The step for which the error would be 1, less a safety margin that grows with the Newton
    /// iterations needed.
    pub(crate) fn propose(&self, h: f64, error: f64, iterations: usize) -> f64 {
        let limit = 2.0 * self.newton_limit as f64;
        let safety = self.safety * (1.0 + limit) / (iterations as f64 + limit);
        let factor = safety.min(self.safety) * error.max(LEAST_ERROR).powf(-self.exponent);
        h * factor.clamp(FACTORS.0, FACTORS.1)
    }

    /// The step to follow an accepted one: the smaller of the classical proposal and the one that
    /// continues the trend of the errors,
    /// h_{n+1} = safety h_n (h_n/h_{n−1}) (err_{n−1}/err_n²)^(1/(s+1)).
    pub(crate) fn accept(&mut self, h: f64, error: f64, iterations: usize) -> f64 {
        let error = error.max(LEAST_ERROR);
        let mut proposal = self.propose(h, error, iterations);
        if let Some((last_h, last_error)) = self.accepted {
            let trend = (h / last_h) * (last_error / (error * error)).powf(self.exponent);
            proposal = proposal.min(h * (self.safety * trend).clamp(FACTORS.0, FACTORS.1));
        }
        self.accepted = Some((h, error.max(LEAST_TREND)));
        proposal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_settle_where_the_estimate_meets_the_tolerance() {
        // err = (h/h*)⁴ for s = 3: the control must end at safety · h*.
        let mut control = Control::new(3, 0.9, 7);
        let mut h = 0.02;
        for _ in 0..50 {
            h = control.accept(h, (h / 0.1f64).powi(4), 1);
        }
        assert!((h - 0.09).abs() < 1e-3, "{h}");
    }

    #[test]
    fn factors_are_bounded_and_many_iterations_lower_the_step() {
        let control = Control::new(3, 0.9, 7);
        assert_eq!(control.propose(1.0, 1e-30, 1), 8.0);
        assert_eq!(control.propose(1.0, 1e30, 1), 0.2);
        assert!(control.propose(1.0, 0.5, 7) < control.propose(1.0, 0.5, 1));
    }
}

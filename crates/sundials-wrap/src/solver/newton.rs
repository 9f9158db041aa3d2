//! Convergence test of Newton's method.

use crate::ffi::callbacks::{Convergence, NewtonIterate};

/// Assumed ratio of the error to the first correction. IDAS starts with this ratio after a change of the step size.
const UNMEASURED: f64 = 100.0;

/// Maximum rate of convergence, as in IDAS.
const LARGEST_RATE: f64 = 0.9;

/// Convergence test of IDAS, except that it uses only convergence rates measured in the same step.
///
/// The error is estimated as |δ| r/(1 − r) from the last correction δ and the convergence rate r. After the first
/// iteration, IDAS uses the r of an earlier step. If the slope of F changes between the steps, this r may be far too
/// small: r is 0 if F is linear.
#[derive(Debug, Default)]
pub(super) struct NewtonTest {
    /// Weighted norm of the first correction.
    first: f64,
}

impl NewtonTest {
    /// Tests the `iterate`. The first iterate is accepted only if its correction is far below the tolerance.
    pub(super) fn judge(&mut self, iterate: &NewtonIterate) -> Convergence {
        let &NewtonIterate { number, correction, tolerance } = iterate;
        let factor = if number == 0 {
            self.first = correction;
            UNMEASURED
        } else {
            let rate = (correction / self.first).powf(1.0 / number as f64);
            if rate > LARGEST_RATE {
                return Convergence::Failed;
            }
            rate / (1.0 - rate)
        };
        match factor * correction <= tolerance {
            true => Convergence::Converged,
            false => Convergence::Continue,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_of_earlier_solves_are_not_used() {
        let mut test = NewtonTest::default();
        let mut judge =
            |number, correction| test.judge(&NewtonIterate { number, correction, tolerance: 0.33 });
        // A linear equation solved exactly by the first iteration.
        assert_eq!(judge(0, 50.0), Convergence::Continue);
        assert_eq!(judge(1, 0.0), Convergence::Converged);
        // An equation with another slope. If the rate is 1/2, the error is equal to the last correction.
        assert_eq!(judge(0, 1.0), Convergence::Continue);
        assert_eq!(judge(1, 0.5), Convergence::Continue);
        assert_eq!(judge(2, 0.25), Convergence::Converged);
        assert_eq!(judge(0, 1.0), Convergence::Continue);
        assert_eq!(judge(1, 0.95), Convergence::Failed);
        assert_eq!(judge(0, 3e-3), Convergence::Converged);
    }
}

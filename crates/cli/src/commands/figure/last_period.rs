//! Buffer for the samples of the last period of the load.

use std::collections::VecDeque;

/// Number of samples per period of the load.
pub(in crate::commands) const PER_PERIOD: f64 = 50.0;

/// Samples of one period, up to the latest sample.
pub(in crate::commands) struct LastPeriod<T> {
    period: f64,
    samples: VecDeque<(f64, T)>,
}

impl<T> LastPeriod<T> {
    /// Creates an empty buffer for a load whose period is `period` (s).
    pub(in crate::commands) fn new(period: f64) -> Self {
        Self { period, samples: VecDeque::new() }
    }

    /// Adds a sample and removes the samples that are at least one period older.
    pub(in crate::commands) fn push(&mut self, t: f64, sample: T) {
        self.samples.push_back((t, sample));
        let begin = t - self.period;
        while self.samples.front().is_some_and(|(oldest, _)| *oldest <= begin) {
            self.samples.pop_front();
        }
    }

    /// Iterates over the samples with their times, oldest first.
    pub(in crate::commands) fn iter(&self) -> impl Iterator<Item = &(f64, T)> {
        self.samples.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_period_is_kept() {
        let mut last = LastPeriod::new(1.0);
        for i in 0..=10 {
            last.push(0.25 * f64::from(i), i);
        }
        let kept: Vec<i32> = last.iter().map(|(_, i)| *i).collect();
        assert_eq!(kept, [7, 8, 9, 10], "the sample one period old is the same phase");
    }
}

//! Records values at fixed times by dense output without altering the steps.

use std::ops::ControlFlow;

use myovib_dae::Problem;

use crate::error::ModelError;
use crate::integration::run::{AcceptedStep, Observer};
use crate::integration::statistics::Outcome;
use crate::signal::timing::just_after;

/// Equidistant times `0, every, 2 every, …` up to and including the end time.
#[derive(Debug, Clone)]
pub struct SampleTimes {
    every: f64,
    end: f64,
    next: u64,
}

impl SampleTimes {
    /// Creates times at intervals of `every` seconds up to `end`.
    ///
    /// # Panics
    /// Panics if `every` is not positive.
    pub fn new(every: f64, end: f64) -> Self {
        assert!(every > 0.0, "the sampling interval {every} s must be positive");
        Self { every, end, next: 0 }
    }

    /// Skips the first `n` times.
    pub fn skip(self, n: u64) -> Self {
        Self { next: n, ..self }
    }

    /// Returns the next time if it is at most `t` up to rounding, and advances to the time after it.
    pub fn due(&mut self, t: f64) -> Option<f64> {
        // A multiple that differs from the end time only by rounding is replaced by the end time.
        let mut time = self.every * self.next as f64;
        if (time - self.end).abs() < 1e-9 * self.every {
            time = self.end;
        }
        (time < just_after(t) && time <= self.end).then(|| {
            self.next += 1;
            time
        })
    }
}

/// Calls a function with the interpolated solution at each sample time.
pub struct Sampler<S> {
    times: SampleTimes,
    sink: S,
    y: Vec<f64>,
}

impl<S> Sampler<S> {
    /// Passes samples of `n` unknowns to `sink(problem, t, y)`. A run that starts later than the first time must
    /// [`skip`](SampleTimes::skip) the earlier times.
    pub fn new(times: SampleTimes, n: usize, sink: S) -> Self {
        Self { times, sink, y: vec![0.0; n] }
    }
}

impl<P, S> Observer<P> for Sampler<S>
where
    P: Problem,
    S: FnMut(&mut P, f64, &[f64]) -> Result<(), ModelError>,
{
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        while let Some(t) = self.times.due(step.to) {
            // Times between a jump and the next step are assigned to the start of that step.
            step.integrator.dense_output(t.clamp(step.from, step.to), 0, &mut self.y)?;
            (self.sink)(step.integrator.problem_mut(), t, &self.y)?;
        }
        Ok(ControlFlow::Continue(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_times_include_both_ends_despite_rounding() {
        let mut times = SampleTimes::new(0.1, 0.3);
        let taken: Vec<f64> = std::iter::from_fn(|| times.due(0.3)).collect();
        assert_eq!(taken.len(), 4);
        assert_eq!((taken[0], taken[3]), (0.0, 0.3));
    }

    #[test]
    fn a_time_is_due_once_its_step_is_reached() {
        let mut times = SampleTimes::new(0.5, 2.0);
        assert_eq!(times.due(0.2), Some(0.0));
        assert_eq!(times.due(0.2), None);
        assert_eq!(times.due(0.7), Some(0.5));
    }
}

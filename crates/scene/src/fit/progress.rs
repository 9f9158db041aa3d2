//! Progress of a fit.

use std::sync::{Mutex, PoisonError};

use crate::watch::ProgressSink;

/// Progress sink that adds the last iteration to the progress of each run.
pub(super) struct FitProgress<'a> {
    sink: &'a dyn ProgressSink,
    iteration: Mutex<String>,
}

impl<'a> FitProgress<'a> {
    /// Creates the progress sink of a fit before its first iteration.
    pub(super) fn new(sink: &'a dyn ProgressSink) -> Self {
        Self { sink, iteration: Mutex::new("first run of the fit".to_owned()) }
    }

    /// Reports iteration `number`. Its `cost` is the sum over the measurements in the first fraction `part` of the
    /// measured time span.
    pub(super) fn iteration(&self, number: usize, part: f64, cost: f64) {
        let share = match part < 1.0 {
            true => format!("the first {:.0} % of the measurement time", 100.0 * part),
            false => "all measurements".to_owned(),
        };
        let text =
            format!("iteration {number}: half the sum of squares is {cost:.6e} over {share}");
        self.sink.on_progress(&|| text.clone());
        let mut iteration = self.iteration.lock().unwrap_or_else(PoisonError::into_inner);
        *iteration = text;
    }
}

impl ProgressSink for FitProgress<'_> {
    fn on_progress(&self, line: &dyn Fn() -> String) {
        self.sink.on_progress(&|| {
            let iteration = self.iteration.lock().unwrap_or_else(PoisonError::into_inner);
            format!("{} ({iteration})", line())
        });
    }
}

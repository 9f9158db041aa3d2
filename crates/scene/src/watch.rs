//! Progress of a run.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use myovib_model::statics::Search;
use myovib_model::{AcceptedStep, ModelError, Observer, Outcome};

/// Receiver of progress messages. A message is formatted only if it is shown.
pub trait ProgressSink: Sync {
    /// Shows the line if a progress message is due.
    fn on_progress(&self, line: &dyn Fn() -> String);

    /// Shows the line even if another line was shown shortly before. Call this method before operations that take a
    /// long time.
    fn report_now(&self, line: &dyn Fn() -> String) {
        self.on_progress(line);
    }
}

/// Ignores all messages.
impl ProgressSink for () {
    fn on_progress(&self, _: &dyn Fn() -> String) {}
}

/// Observer of a computation.
#[derive(Clone, Copy)]
pub struct Watcher<'a> {
    /// Flag that interrupts the computation.
    pub interrupt: Option<&'static AtomicBool>,
    /// Receiver of progress messages.
    pub progress: &'a dyn ProgressSink,
}

impl Watcher<'_> {
    /// Watcher without progress messages and without interruption.
    pub const NOBODY: Watcher<'static> = Watcher { interrupt: None, progress: &() };

    pub fn is_interrupted(&self) -> bool {
        let interrupt = self.interrupt;
        interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// Observer that shows the time, the number of steps, the order, the step size and the remaining time on a progress
/// line. Several runs may share the line.
pub struct Watch<'a> {
    label: String,
    t_end: f64,
    progress: &'a dyn ProgressSink,
    /// Simulated time (s), number of steps, and wall-clock time at the start of the run.
    start: Option<(f64, u64, Instant)>,
}

impl<'a> Watch<'a> {
    /// Creates an observer for the run called `label`, which ends at `t_end` (s).
    pub fn new(label: String, t_end: f64, progress: &'a dyn ProgressSink) -> Self {
        Self { label, t_end, progress, start: None }
    }
}

impl<P> Observer<P> for Watch<'_> {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let (t_start, before, began) = *self.start.get_or_insert_with(|| {
            let before = step.integrator.counts().steps.saturating_sub(1);
            (step.from, before, Instant::now())
        });
        self.progress.on_progress(&|| {
            let counts = step.integrator.counts();
            // Steps often grow after a ramp, so the mean step may be much shorter than the current steps.
            let steps = counts.steps.saturating_sub(before).max(1) as f64;
            let mean_step = (step.to - t_start) / steps;
            let remaining_steps = (self.t_end - step.to) / mean_step.max(counts.last_step);
            let left = began.elapsed().as_secs_f64() / steps * remaining_steps;
            format!(
                "{}: t = {:.3} of {} s, {} steps, h = {:.1e} s, order {}, {left:.0} s left",
                self.label, step.to, self.t_end, counts.steps, counts.last_step, counts.last_order
            )
        });
        Ok(ControlFlow::Continue(()))
    }
}

/// Returns a callback that reports the progress of the search for an equilibrium and interrupts the search on request.
pub(crate) fn search(watcher: Watcher<'_>) -> impl FnMut(&Search) -> ControlFlow<()> {
    move |at| {
        watcher.progress.on_progress(&|| {
            let [from, to] = [at.reached, at.target].map(|part| 100.0 * part);
            format!(
                "equilibrium: step {}, {from:.1} to {to:.1} % of the load, Newton iteration {}, {} in total",
                at.load_step, at.iteration, at.iterations
            )
        });
        match watcher.is_interrupted() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

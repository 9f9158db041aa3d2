//! Progress of a run.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use myovib_model::statics::Search;
use myovib_model::{AcceptedStep, ModelError, Observer, Outcome};

/// Receiver of progress messages. A message is only formatted if it is shown.
pub trait ProgressSink: Sync {
    /// Shows the line if it is due.
    fn on_progress(&self, line: &dyn Fn() -> String);

    /// Shows the line even if another line was shown just before, for operations that take a long time.
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
    /// Neither progress messages nor interruption.
    pub const NOBODY: Watcher<'static> = Watcher { interrupt: None, progress: &() };

    /// Returns whether the flag is set.
    pub fn is_interrupted(&self) -> bool {
        let interrupt = self.interrupt;
        interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// An observer that shows time, steps, order, step size and remaining time on a progress line,
/// which several runs may share.
pub struct Watch<'a> {
    label: String,
    t_end: f64,
    progress: &'a dyn ProgressSink,
    /// Start time of the run, s, and the wall-clock time at the start.
    start: Option<(f64, Instant)>,
}

impl<'a> Watch<'a> {
    /// Observes the run called `label` that ends at `t_end` (s).
    pub fn new(label: String, t_end: f64, progress: &'a dyn ProgressSink) -> Self {
        Self { label, t_end, progress, start: None }
    }
}

impl<P> Observer<P> for Watch<'_> {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let (t_start, began) = *self.start.get_or_insert_with(|| (step.from, Instant::now()));
        self.progress.on_progress(&|| {
            let counts = step.integrator.counts();
            let done = (step.to - t_start) / (self.t_end - t_start);
            let left = began.elapsed().as_secs_f64() * (1.0 - done) / done;
            format!(
                "{}: t = {:.3} of {} s, {} steps, h = {:.1e} s, order {}, {left:.0} s left",
                self.label, step.to, self.t_end, counts.steps, counts.last_step, counts.last_order
            )
        });
        Ok(ControlFlow::Continue(()))
    }
}

/// Returns a callback that reports the progress of the search for an equilibrium and interrupts it
/// on request.
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

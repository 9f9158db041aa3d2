//! Shows how far a run is.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use myovib_model::statics::Search;
use myovib_model::{ModelError, Observer, Outcome, Step};

/// Who is told how far a computation is. The line is only made if it is wanted.
pub trait Tell: Sync {
    /// Shows the line, or not.
    fn tell(&self, line: &dyn Fn() -> String);

    /// Shows the line even if another one was shown just now: what it tells of takes long.
    fn tell_now(&self, line: &dyn Fn() -> String) {
        self.tell(line);
    }
}

/// Nobody.
impl Tell for () {
    fn tell(&self, _: &dyn Fn() -> String) {}
}

/// Who watches a computation.
#[derive(Clone, Copy)]
pub struct Watcher<'a> {
    /// A flag that ends it.
    pub interrupt: Option<&'static AtomicBool>,
    /// Who is told how far it is.
    pub progress: &'a dyn Tell,
}

impl Watcher<'_> {
    /// Nobody.
    pub const NOBODY: Watcher<'static> = Watcher {
        interrupt: None,
        progress: &(),
    };

    /// Whether the flag is set.
    pub fn is_interrupted(&self) -> bool {
        let interrupt = self.interrupt;
        interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// An observer that shows time, steps, order, step size and the time left on a progress line, which
/// several runs may share.
pub struct Watch<'a> {
    label: String,
    t_end: f64,
    progress: &'a dyn Tell,
    /// Where the run began, s, and when.
    start: Option<(f64, Instant)>,
}

impl<'a> Watch<'a> {
    /// Watches the run called `label` that ends at `t_end` (s).
    pub fn new(label: String, t_end: f64, progress: &'a dyn Tell) -> Self {
        Self {
            label,
            t_end,
            progress,
            start: None,
        }
    }
}

impl<P> Observer<P> for Watch<'_> {
    fn accepted(&mut self, step: &mut Step<'_, P>) -> Result<ControlFlow<Outcome>, ModelError> {
        let (t_start, began) = *self
            .start
            .get_or_insert_with(|| (step.from, Instant::now()));
        self.progress.tell(&|| {
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

/// What tells the `watcher` how far the search for an equilibrium is, and ends it.
pub(crate) fn search(watcher: Watcher<'_>) -> impl FnMut(&Search) -> ControlFlow<()> {
    move |at| {
        watcher.progress.tell(&|| {
            let [from, to] = [at.reached, at.target].map(|part| 100.0 * part);
            format!(
                "equilibrium: step {}, {from:.1} to {to:.1} % of the load, Newton iteration {}, {} in all",
                at.load_step, at.iteration, at.iterations
            )
        });
        match watcher.is_interrupted() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

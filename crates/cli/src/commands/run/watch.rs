//! Progress of a run: simulated time, steps, order, step size, estimated time left.

use std::ops::ControlFlow;
use std::time::Instant;

use myovib_model::{ModelError, Observer, Outcome, Step};

use crate::progress::Progress;

/// Shows how far the run is.
pub(super) struct Watch {
    progress: Progress,
    started: Instant,
    t_start: f64,
    t_end: f64,
}

impl Watch {
    /// A run from `t_start` to `t_end`.
    pub(super) fn new(quiet: bool, t_start: f64, t_end: f64) -> Self {
        Self {
            progress: Progress::new(quiet),
            started: Instant::now(),
            t_start,
            t_end,
        }
    }
}

impl<P> Observer<P> for Watch {
    fn accepted(&mut self, step: &mut Step<'_, P>) -> Result<ControlFlow<Outcome>, ModelError> {
        let Self {
            progress,
            started,
            t_start,
            t_end,
        } = self;
        progress.show(|| {
            let counts = step.integrator.counts();
            let done = (step.to - *t_start) / (*t_end - *t_start);
            let left = started.elapsed().as_secs_f64() * (1.0 - done) / done.max(f64::MIN_POSITIVE);
            format!(
                "t = {:.4} of {t_end} s ({:.0} %), {} steps, order {}, h = {:.1e} s, {left:.0} s left",
                step.to,
                100.0 * done,
                counts.steps,
                counts.last_order,
                counts.last_step,
            )
        });
        Ok(ControlFlow::Continue(()))
    }
}

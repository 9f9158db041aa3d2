//! Where each step of a run has to end.

use myovib_dae::Statistics;

use crate::signal::schedule::Schedule;

/// A step that was shortened says nothing of the step proposed before it: the next is at most so
/// many times as long, the most by which a step of Radau IIA grows.
const GROWTH: f64 = 8.0;

/// The schedule of a run to its end, and how far along it is.
pub(crate) struct Pace {
    schedule: Schedule,
    t_end: f64,
    /// Whether the last step was shorter than the integrator proposed.
    shortened: bool,
}

/// What an integrator is told before a step.
pub(crate) struct Bounds {
    /// t_out, which gives the first step its scale.
    pub(crate) t_out: f64,
    /// The time not to step over.
    pub(crate) stop_time: f64,
}

impl Pace {
    /// For a run to `t_end` of a system that is driven by a `schedule`.
    pub(crate) fn new(schedule: Schedule, t_end: f64) -> Self {
        Self {
            schedule,
            t_end,
            shortened: false,
        }
    }

    /// Whether the last step was shorter than the integrator proposed: all that is kept of the past.
    pub(crate) fn shortened(&self) -> bool {
        self.shortened
    }

    /// Goes on with what [`shortened`](Self::shortened) gave.
    pub(crate) fn restore(&mut self, shortened: bool) {
        self.shortened = shortened;
    }

    /// From when on a run that has reached the time `t` goes on behind a jump there, if there is one.
    pub(crate) fn after_jump(&self, t: f64) -> Option<f64> {
        self.schedule.after_jump(t)
    }

    /// The end of the run.
    pub(crate) fn t_end(&self) -> f64 {
        self.t_end
    }

    /// The bounds of the next step at `t` of an integrator with these counters.
    pub(crate) fn bounds(&mut self, t: f64, statistics: &Statistics) -> Bounds {
        // What a start behind a jump finds is of the steps before it.
        let is_first = statistics.steps == 0;
        let shortened = self.shortened && !is_first;
        let t_out = match is_first {
            true => self.schedule.look_ahead(t, self.t_end),
            false => self.t_end,
        };
        let proposed = match statistics.current_step {
            // The first step is at most a thousandth of the way to t_out.
            _ if is_first => 1e-3 * (t_out - t),
            step if shortened => step.min(GROWTH * statistics.last_step),
            step => step,
        };
        let stop_time = self.schedule.limit(t, proposed, self.t_end);
        let stop_time = match shortened {
            true => stop_time.min(t + proposed),
            false => stop_time,
        };
        self.shortened = stop_time - t < statistics.current_step;
        Bounds { t_out, stop_time }
    }
}

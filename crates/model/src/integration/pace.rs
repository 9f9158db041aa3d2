//! End time of each step of a run.

use myovib_dae::Statistics;

use crate::signal::schedule::Schedule;

/// Maximum growth of the step after a shortened step. A shortened step gives no information about the step size that
/// the accuracy allows. The value equals the growth limit of Radau IIA.
const GROWTH: f64 = 8.0;

/// The schedule of a run and its progress.
pub(crate) struct Pace {
    schedule: Schedule,
    t_end: f64,
    /// Whether the last step was shorter than proposed by the integrator.
    shortened: bool,
}

/// Bounds passed to an integrator before a step.
pub(crate) struct Bounds {
    /// t_out, which sets the scale of the first step.
    pub(crate) t_out: f64,
    /// Time that the step must not pass.
    pub(crate) stop_time: f64,
    /// Whether the step resolves all inputs, so that no input can act undetected between its stages.
    pub(crate) is_resolved: bool,
}

impl Pace {
    /// Creates the step limits of a run to `t_end` for a system whose excitation has this `schedule`.
    pub(crate) fn new(schedule: Schedule, t_end: f64) -> Self {
        Self { schedule, t_end, shortened: false }
    }

    /// Returns whether the last step was shorter than proposed by the integrator. This is the only state that changes.
    pub(crate) fn shortened(&self) -> bool {
        self.shortened
    }

    /// Restores the result of [`shortened`](Self::shortened).
    pub(crate) fn restore(&mut self, shortened: bool) {
        self.shortened = shortened;
    }

    /// Returns the time just after a jump, if there is a jump at time `t`.
    pub(crate) fn after_jump(&self, t: f64) -> Option<f64> {
        self.schedule.after_jump(t)
    }

    /// Returns the end time of the run.
    pub(crate) fn t_end(&self) -> f64 {
        self.t_end
    }

    /// Returns the bounds of the next step at `t` for an integrator with these `statistics`.
    pub(crate) fn bounds(&mut self, t: f64, statistics: &Statistics) -> Bounds {
        // After a jump, the step size of earlier steps does not apply.
        let is_first = statistics.steps == 0;
        let shortened = self.shortened && !is_first;
        let t_out = match is_first {
            true => self.schedule.look_ahead(t, self.t_end),
            false => self.t_end,
        };
        let proposed = match statistics.current_step {
            // The estimated first step is at most a thousandth of the distance to t_out.
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
        // The stop time may be far away, and signals such as recordings examine the whole interval.
        let is_resolved = self.schedule.is_resolved(t, stop_time.min(t + proposed));
        Bounds { t_out, stop_time, is_resolved }
    }
}

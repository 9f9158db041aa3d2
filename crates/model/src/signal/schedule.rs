//! Times at which the steps of a run must end, and limits on the step size, so that no load is missed.
//!
//! An error estimate depends on a load only through the points at which a step evaluates it. While a body is at rest,
//! nothing else indicates an approaching pulse, so the steps would grow until they skip the pulse. Therefore, each step
//! ends at the next break of the signals that drive the system. In addition, the step size is limited to a fraction of
//! the duration of any change within the step. A load that is smooth throughout requires no additional steps.

use std::sync::Arc;

use super::timing::{Break, TimeScales, just_after, shortest};

/// Ratio of t_out − t, which determines the size of a first step from t, to the shortest time scale of the system. Both
/// integrators begin with `min(0.001 · (t_out − t), 0.5/‖ẏ‖)`. At rest, ẏ provides no scale, so the first term
/// determines the step size: 0.08 of the time scale, or half a radian of a sine. For the paper's frequency of 8 Hz,
/// t_out is 10 s, the end of the runs in Table 2.
const AHEAD: f64 = 80.0;

/// Times are considered equal if their relative difference is below this value, which is a few thousand times the unit
/// roundoff and shorter than any step of an integrator.
pub(crate) const ROUNDING: f64 = 1e-12;

/// Signals that drive a system.
#[derive(Clone, Default)]
pub struct Schedule {
    /// The driving functions, each with the number of its derivatives that occur in the equations.
    drives: Vec<(Arc<dyn TimeScales>, u8)>,
    /// Shortest time scale of the system without its drives, s.
    own_time: Option<f64>,
}

impl Schedule {
    /// Adds a function of time. `derivatives` is the number of its derivatives that occur in the equations.
    pub fn add(&mut self, drive: impl TimeScales + 'static, derivatives: u8) {
        self.drives.push((Arc::new(drive), derivatives));
    }

    /// Adds time scales (s) on which the system changes without excitation. They only limit the first step.
    pub(crate) fn add_own_times(&mut self, times: impl IntoIterator<Item = f64>) {
        self.own_time = shortest(times.into_iter().chain(self.own_time));
    }

    /// Returns the first break of the equations after the time `after`.
    pub fn next_break(&self, after: f64) -> Option<Break> {
        let breaks = self.drives.iter().filter_map(|(drive, derivatives)| {
            let next = drive.next_break(after)?;
            Some(Break { order: next.order.saturating_sub(*derivatives), ..next })
        });
        breaks.reduce(Break::earlier)
    }

    /// Returns the time just after the last jump at `t` or within rounding errors after `t`. From this time on, the
    /// values after the jump drive the system. Returns `None` without a jump.
    pub(crate) fn after_jump(&self, t: f64) -> Option<f64> {
        let first = self.next_break(t.next_down());
        let breaks = std::iter::successors(first, |last| self.next_break(last.t));
        let here = breaks.take_while(|next| next.t <= t + ROUNDING * t.abs());
        let jumps = here.filter(|next| next.order == 0);
        jumps.last().map(|jump| just_after(jump.t))
    }

    /// Returns the first jump (s) of the equations after the time `after`.
    pub(crate) fn next_jump(&self, after: f64) -> Option<f64> {
        let first = self.next_break(after);
        let mut breaks = std::iter::successors(first, |last| self.next_break(last.t));
        breaks.find(|next| next.order == 0).map(|jump| jump.t)
    }

    /// Returns the shortest time scale (s) of the changes of all signals between two times.
    pub fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let drives = self.drives.iter();
        shortest(drives.filter_map(|(drive, _)| drive.time_scale(from, to)))
    }

    /// Returns whether limits on the step size resolve all changes between two times. Returns `false` without driving
    /// functions, because the schedule then contains no information.
    pub(crate) fn is_resolved(&self, from: f64, to: f64) -> bool {
        !self.drives.is_empty() && self.drives.iter().all(|(drive, _)| drive.is_resolved(from, to))
    }

    /// Returns the time t_out that determines the scale of the first step at time `t`. If the system has no time scale
    /// and is not driven, this is the end of the run.
    pub(crate) fn look_ahead(&self, t: f64, t_end: f64) -> f64 {
        let times = self.time_scale(t, t_end).into_iter().chain(self.own_time);
        shortest(times).map_or(t_end, |time| t + AHEAD * time)
    }

    /// Returns the longest step from `t`, at most `h`, that resolves all changes.
    pub(crate) fn longest_step(&self, t: f64, h: f64) -> f64 {
        let (mut h, least) = (h, ROUNDING * t.abs());
        let allowed = |h: f64| {
            let drives = self.drives.iter();
            shortest(drives.filter_map(|(drive, _)| drive.longest_step(t, t + h)))
        };
        // A shorter step contains fewer changes, so halving finds a size within a factor of two of the longest possible
        // step.
        while let Some(allowed) = allowed(h) {
            // A step of the same size as the last limited step is not limited again because of rounding errors.
            // Otherwise, the number of steps would depend on the unit of time.
            if h <= allowed.max(least) + ROUNDING * (t.abs() + h) {
                break;
            }
            h = allowed.max(0.5 * h).max(least);
        }
        h
    }

    /// Returns the latest time at which a step from `t` of size `proposed` may end. The limit is the next break, the
    /// end of the run, or a fraction of the time scales.
    pub fn limit(&self, t: f64, proposed: f64, t_end: f64) -> f64 {
        let last = t_end - ROUNDING * t_end.abs();
        let next = self.next_break(t + ROUNDING * t.abs());
        let next = next.map_or(t_end, |next| next.t);
        let next = if next < last { next } else { t_end };
        let left = next - t;
        let step = self.longest_step(t, proposed.min(left));
        let reached = t + proposed + ROUNDING * next.abs();
        match () {
            () if step < proposed.min(left) => t + step,
            // The interval that remains before a break is divided between two steps, so that
            // neither is tiny.
            () if next < t_end && reached < next && left < 2.0 * proposed => t + 0.5 * left,
            () => next,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::timing::Unforeseen;
    use super::*;
    use crate::signal::{Signal, formula};

    fn schedule(signal: Signal, derivatives: u8) -> Schedule {
        let mut schedule = Schedule::default();
        schedule.add(signal, derivatives);
        schedule
    }

    fn step(start: f64) -> Signal {
        Signal::from(formula::StepFunction { value: 1.0, start, rise: 0.02 })
    }

    #[test]
    fn the_papers_run_keeps_its_first_step() {
        let paper = schedule(Signal::paper(100.0), 0);
        assert_eq!(paper.look_ahead(0.0, 10.0), 10.0);
        assert_eq!(paper.look_ahead(0.0, 2000.0), 10.0);
        assert_eq!(Schedule::default().look_ahead(1.0, 7.0), 7.0);
    }

    #[test]
    fn continuing_and_unforeseen_changes_are_not_resolved() {
        let mut pulse = schedule(step(1.0), 0);
        assert!(pulse.is_resolved(0.0, 1.0) && pulse.is_resolved(1.0, 1.005));
        let sine = Signal::from(formula::Sine { amplitude: 1.0, frequency: 8.0, phase: 0.0 });
        assert!(!schedule(sine, 0).is_resolved(0.0, 0.01));
        // Steps over a ramped sine are limited only during the rise.
        assert!(!schedule(Signal::paper(1.0), 0).is_resolved(9.0, 9.1));
        assert!(!Schedule::default().is_resolved(0.0, 1.0));
        pulse.add(Unforeseen, 0);
        assert!(!pulse.is_resolved(0.0, 1.0));
    }

    #[test]
    fn no_step_passes_a_break_or_a_quarter_of_a_rise() {
        let pulse = schedule(step(1.0), 0);
        assert_eq!(pulse.limit(0.0, 5.0, 10.0), 1.0);
        assert_eq!(pulse.limit(0.0, 0.7, 10.0), 0.5);
        assert_eq!(pulse.limit(0.0, 0.1, 10.0), 1.0);
        assert_eq!(pulse.limit(0.5, 0.4, 10.0), 0.75);
        // Regression: a step that ended slightly before the break, due to rounding errors, was divided in two, and the
        // number of steps depended on the unit of time.
        assert_eq!(pulse.limit(0.5, 0.5 - 1e-16, 10.0), 1.0);
        assert_eq!(pulse.limit(1.0, 0.7, 10.0), 1.0 + 0.005);
        assert_eq!(pulse.limit(1.02, 0.7, 10.0), 10.0);
        assert_eq!(pulse.limit(0.0, 5.0, 0.4), 0.4);
        // Regression: a step of the last size was not limited any further, so the rest of the rise was not divided.
        for rounding in [-f64::EPSILON, 0.0, 2.0 * f64::EPSILON] {
            let half_of_rest = 0.5 * (1.02 - 1.0125);
            assert_eq!(pulse.limit(1.0125, 0.005 * (1.0 + rounding), 10.0), 1.0125 + half_of_rest);
        }
        let late = schedule(step(1e5), 0);
        let (start, next) = (1e5 + 0.0125, 1e5 + 0.005);
        let middle = start + 0.5 * (1e5 + 0.02 - start);
        // The step size has a rounding error of 1.5e-11, which is 1e-9 of its value.
        assert!((late.limit(start, next - 1e5, 2e5) - middle).abs() < 1e-10);
    }

    #[test]
    fn steps_approach_a_burst_that_does_not_break() {
        let times: Vec<f64> = (0..=2000).map(|i| 1e-3 * f64::from(i)).collect();
        let values = times.iter().map(|t| if *t == 1.5 { 1.0 } else { 0.0 });
        let table = crate::Spline::new(times.clone(), values.collect()).unwrap();
        let table = schedule(Signal::from(table), 0);
        let (mut t, mut steps) = (0.0, 0);
        while t < 1.5 {
            t += table.longest_step(t, 1.0);
            steps += 1;
        }
        // The distances are halved from 1 s to 0.2 ms, and the spline has ripples before the pulse.
        assert!((10..80).contains(&steps), "{steps}");
    }

    #[test]
    fn derivatives_of_a_motion_break_earlier() {
        let moved = schedule(step(1.0), 2);
        assert_eq!(moved.next_break(0.0), Some(Break { t: 1.0, order: 1 }));
    }

    #[test]
    fn a_jump_is_passed_once() {
        let jump = |start| Signal::from(formula::StepFunction { value: 1.0, start, rise: 0.0 });
        // 0.1 + 0.2 differs from 0.3 by rounding, so a single step passes both breaks.
        let both = Signal::sum(vec![jump(0.3), jump(0.1 + 0.2), jump(0.0), step(1.0)]);
        let driven = schedule(both.clone(), 0);
        for start in [0.0, 0.3] {
            let after = driven.after_jump(start).unwrap();
            assert!(after > start && after <= start + 1e-14);
            assert_eq!(driven.after_jump(after), None);
        }
        assert_eq!(both.at(driven.after_jump(0.0).unwrap()).value, 1.0);
        assert_eq!(both.at(driven.after_jump(0.3).unwrap()).value, 3.0);
        assert_eq!(driven.next_jump(0.0), Some(0.3));
        assert_eq!(driven.next_jump(0.5), None);
        assert_eq!(driven.after_jump(1.0), None);
        // Steps end at this time, as at other breaks.
        assert_eq!(driven.limit(just_after(0.0), 5.0, 10.0), 0.3);
    }
}

//! Times at which a function of time changes, and the time scales of the changes. The steps of an integration must
//! resolve these time scales.
//!
//! A [`Break`] is a time at which a derivative jumps. Steps end at breaks. If nothing jumps, transient changes (a rise,
//! the bends of a table) are resolved by steps of a fraction of their duration. A continuing sine is resolved by the
//! size of the first step, and then by error estimates.

/// A time at which a derivative of a function of time jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Break {
    /// Time, s.
    pub t: f64,
    /// Order of the lowest derivative that jumps: 0 for the value itself, 1 for a kink.
    pub order: u8,
}

impl Break {
    /// Returns the earlier of two breaks; at equal times, the break with the lower derivative.
    pub fn earlier(self, other: Self) -> Self {
        if (other.t, other.order) < (self.t, self.order) { other } else { self }
    }
}

/// Offset after a jump, relative to the time of the jump. It exceeds the rounding errors of the stage times of a step
/// that ends at the jump, but is shorter than any step of an integrator.
const PASSED: f64 = 16.0 * f64::EPSILON;
/// Time (s) to which the offset is relative for a jump at t = 0.
const LEAST_TIME: f64 = 1e-290;

/// Returns the first time after a jump or kink at `t`. Before this time, a function has its left value and slope; from
/// this time on, it has its right value and slope.
pub(crate) fn just_after(t: f64) -> f64 {
    t + PASSED * t.abs().max(LEAST_TIME)
}

/// Properties of a signal needed to choose steps. The default implementations describe a constant.
pub trait TimeScales: Send + Sync {
    /// Returns the first break after the time `after`.
    fn next_break(&self, _after: f64) -> Option<Break> {
        None
    }

    /// Returns the shortest time scale (s) of changes of the function between two times; `None` if it is constant.
    fn time_scale(&self, _from: f64, _to: f64) -> Option<f64> {
        None
    }

    /// Returns the longest step (s) that cannot miss a change between two times; `None` if nothing changes.
    fn longest_step(&self, _from: f64, _to: f64) -> Option<f64> {
        None
    }

    /// Returns whether the function is constant between two times or limits the steps. A continuing sine does neither:
    /// only error estimates resolve it.
    fn is_resolved(&self, from: f64, to: f64) -> bool {
        self.time_scale(from, to).is_none() || self.longest_step(from, to).is_some()
    }
}

/// Changes at unknown times, such as impacts.
pub(crate) struct Unforeseen;

impl TimeScales for Unforeseen {
    fn is_resolved(&self, _: f64, _: f64) -> bool {
        false
    }
}

/// Step size as a fraction of the time scale: a change is resolved by four steps, and a sine by four steps per period.
pub(crate) const FRACTION: f64 = 0.25;

/// Returns the shortest positive and finite time, if any.
pub(crate) fn shortest(times: impl IntoIterator<Item = f64>) -> Option<f64> {
    let meaningful = |time: &f64| *time > 0.0 && time.is_finite();
    times.into_iter().filter(meaningful).reduce(f64::min)
}

/// Returns the first of the two `times` after the time `after`, as a break of this `order`.
pub(super) fn first(times: [f64; 2], after: f64, order: u8) -> Option<Break> {
    let later = times.into_iter().find(|t| *t > after)?;
    Some(Break { t: later, order })
}

/// Returns 0 if both times are before the rise of a function, `value` if both are after the rise, and otherwise `None`.
pub(super) fn between([start, end]: [f64; 2], value: f64, from: f64, to: f64) -> Option<f64> {
    match () {
        () if to <= start => Some(0.0),
        () if from >= end => Some(value),
        () => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::formula::{Ramp, RampedSine, Sine, StepFunction};
    use super::super::spline::Spline;
    use super::*;
    use crate::signal::Signal;

    fn step(value: f64, start: f64) -> Signal {
        Signal::from(StepFunction { value, start, rise: 0.02 })
    }

    fn sine(frequency: f64) -> Signal {
        Signal::from(Sine { amplitude: 1.0, frequency, phase: 0.0 })
    }

    #[test]
    fn a_pulse_breaks_where_it_rises_and_falls_and_is_constant_elsewhere() {
        let pulse = Signal::sum(vec![step(100.0, 1.0), step(-100.0, 1.1)]);
        let times: Vec<f64> = pulse.breaks(0.0, 10.0).map(|b| b.t).collect();
        assert_eq!(times, [1.0, 1.0 + 0.02, 1.1, 1.1 + 0.02]);
        for ((from, to), scale) in [
            ((0.0, 1.0), None),
            ((0.0, 1.001), Some(0.02)),
            ((1.019, 1.5), Some(0.02)),
            ((1.03, 1.09), None),
            ((1.2, 9.0), None),
        ] {
            assert_eq!(pulse.time_scale(from, to), scale, "{from} to {to}");
        }
    }

    /// Compares reported breaks of order k with values. The derivative of order k − 1 must be continuous, and at a kink
    /// the first derivative must jump.
    #[test]
    fn breaks_are_where_derivatives_jump() {
        let ramp = Signal::from(Ramp { value: 2.0, start: 0.5, end: 1.5 });
        let both = Signal::sum(vec![ramp, step(1.0, 0.5)]);
        let breaks: Vec<_> = both.breaks(0.0, 2.0).map(|b| (b.t, b.order)).collect();
        assert_eq!(breaks, [(0.5, 1), (0.52, 3), (1.5, 1)]);
        for (t, order) in breaks {
            let (before, after) = (both.at(t - 1e-12), both.at(t + 1e-12));
            assert!((before.value - after.value).abs() < 1e-10);
            // The slopes are 2/s and at most 1.9/0.02 s. At 1e-12 s from the ends of the step, its slope is below 1e-9.
            let kinked = (before.d1 - after.d1).abs() > 1.0;
            assert_eq!(kinked, order == 1, "{t}");
            // Steps end at t and continue just after it; the step is steeper by 2e-11/s after 1e-12 s.
            let slopes = [both.at(t).d1 - before.d1, both.at(just_after(t)).d1 - after.d1];
            assert!(slopes.iter().all(|change| change.abs() < 1e-9), "{t}: {slopes:?}");
        }
    }

    #[test]
    fn a_zero_factor_hides_the_jumps_of_the_other_factor() {
        let burst =
            Signal::product(vec![Signal::sum(vec![step(1.0, 1.0), step(-1.0, 2.0)]), sine(500.0)]);
        assert_eq!(burst.time_scale(0.0, 1.0), None);
        assert_eq!(burst.longest_step(0.0, 1.01), Some(0.0005));
        // After the ramp, the function is a sine.
        assert_eq!(burst.longest_step(1.5, 1.6), None);
        assert_eq!(burst.time_scale(0.0, 1.5), Some(0.002));
        assert_eq!(burst.time_scale(1.5, 1.6), Some(0.002));
        assert_eq!(burst.time_scale(2.02, 9.0), None);
    }

    #[test]
    fn a_sigmoid_is_steep_around_its_middle_only() {
        let switched =
            Signal::from(RampedSine { amplitude: 1.0, frequency: 2.0, steepness: 1e4, shift: 3e4 });
        assert_eq!(switched.time_scale(0.0, 2.9), Some(0.5));
        assert_eq!(switched.time_scale(0.0, 3.1), Some(4e-4));
        assert_eq!(switched.time_scale(3.1, 9.0), Some(0.5));
        assert_eq!(Signal::paper(1.0).time_scale(0.0, 10.0), Some(0.125));
    }

    /// A smooth step of 100 rad within 1 s is at rest at both ends, and fastest in between.
    #[test]
    fn a_rotation_has_the_time_scale_of_its_largest_speed() {
        let angle = Signal::from(StepFunction { value: 100.0, start: 0.0, rise: 1.0 });
        let fastest = 1.0 / angle.at(0.5).d1;
        let found = Signal::sine(angle).time_scale(0.0, 1.0);
        assert_eq!(found, Some(fastest));
    }

    #[test]
    fn a_table_has_the_time_scale_of_its_bends_where_they_are() {
        let times: Vec<f64> = (0..=1000).map(|i| 1e-3 * f64::from(i)).collect();
        let pulse = times.iter().map(|t| if *t == 0.5 { 3.0 } else { 0.0 });
        let table = Spline::new(times.clone(), pulse.collect()).unwrap();
        let table = Signal::from(table);
        let there = table.time_scale(0.0, 0.6).unwrap();
        assert!(there > 0.5e-3 && there < 1e-3, "{there}");
        // In a spline, the influence of a point decreases by a factor of 3.7 from one row to the next.
        assert!(table.time_scale(0.0, 0.45).is_none_or(|scale| scale > 10.0));
        assert_eq!(table.next_break(0.0), None);

        let slow = times.iter().map(|t| (std::f64::consts::TAU * t).sin());
        let table = Spline::new(times.clone(), slow.collect()).unwrap();
        // The time scale is √(2 · 2/(2π)²) s for a sine of 1 Hz and range 2.
        let period = Signal::from(table).time_scale(0.1, 0.9).unwrap();
        assert!((period - 1.0 / std::f64::consts::PI).abs() < 1e-3, "{period}");
    }
}

//! Tables of values: piecewise linear, or monotone piecewise cubic (PCHIP).
//!
//! # References
//! - F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM J. Sci.
//!   Stat. Comput. 5 (1984) 300–304.

use super::TimeFunction;
use super::jet::Jet;
use super::timing::{Break, just_after, shortest};
use crate::error::ModelError;

/// Points of a function of time: ascending times (s) with a finite value at each time.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    pub(super) times: Vec<f64>,
    pub(super) values: Vec<f64>,
    /// Largest minus smallest value.
    pub(super) spread: f64,
}

impl Points {
    /// Creates the points after checking `times` (s) and `values`.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if there are fewer than two points, if the times are not ascending, or if a number is
    /// not finite.
    ///
    /// # Panics
    /// Panics if the lengths differ.
    pub fn new(times: Vec<f64>, values: Vec<f64>) -> Result<Self, ModelError> {
        assert_eq!(times.len(), values.len(), "a value for each time");
        let fail = |name, value, allowed| Err(ModelError::OutOfRange { name, value, allowed });
        if times.len() < 2 {
            return fail("rows of a table", times.len() as f64, "2 or more");
        }
        if let Some(bad) = times.iter().chain(&values).find(|x| !x.is_finite()) {
            return fail("number in a table", *bad, "finite");
        }
        if let Some(pair) = times.windows(2).find(|pair| pair[1] <= pair[0]) {
            return fail("time in a table", pair[1], "greater than the previous time");
        }
        Ok(Self::spanning(times, values))
    }

    /// Creates the points without checks.
    pub(super) fn spanning(times: Vec<f64>, values: Vec<f64>) -> Self {
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        Self { spread: largest - smallest, times, values }
    }

    /// Returns the first and the last time (s).
    pub fn range(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// Returns the index of the interval that contains time `t`. Outside the range, this is the first or last interval.
    pub(super) fn interval(&self, t: f64) -> usize {
        let after = self.times.partition_point(|&start| start <= t);
        after.saturating_sub(1).min(self.times.len() - 2)
    }

    /// Returns the slope of the straight line over an interval.
    fn slope(&self, i: usize) -> f64 {
        (self.values[i + 1] - self.values[i]) / (self.times[i + 1] - self.times[i])
    }

    /// Returns the time (s) in which the steepest line between two times covers the range of the values.
    pub(super) fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let slopes = (self.interval(from)..=self.interval(to)).map(|i| self.slope(i).abs());
        shortest([self.spread / slopes.fold(0.0, f64::max)])
    }

    /// Returns the value if it is constant between two times.
    fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        let (first, last) = (self.interval(from), self.interval(to.next_down()));
        let values = &self.values[first..=last.max(first) + 1];
        values.iter().all(|y| *y == values[0]).then_some(values[0])
    }
}

/// Piecewise linear interpolation. The first and last lines are extended beyond the ends. Steps end at each point where
/// the slope jumps.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline(pub Points);

impl TimeFunction for Polyline {
    fn at(&self, t: f64) -> Jet {
        let i = self.0.interval(t);
        let is_at_kink = i > 0 && t < just_after(self.0.times[i]);
        let slope = self.0.slope(if is_at_kink { i - 1 } else { i });
        Jet { value: self.0.values[i] + slope * (t - self.0.times[i]), d1: slope, d2: 0.0 }
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        self.0.time_scale(from, to)
    }

    fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        self.0.constant_over(from, to)
    }

    fn next_break(&self, after: f64) -> Option<Break> {
        let first = self.0.times.partition_point(|&t| t <= after);
        let inner = first.max(1)..self.0.times.len() - 1;
        let kink = { inner }.find(|&i| self.0.slope(i - 1) != self.0.slope(i))?;
        Some(Break { t: self.0.times[kink], order: 1 })
    }

    fn lowest_jump(&self) -> u8 {
        match self.next_break(f64::NEG_INFINITY) {
            Some(_) => 1,
            None => 3,
        }
    }

    fn range(&self) -> (f64, f64) {
        self.0.range()
    }
}

/// Monotone cubic interpolation. The slope is continuous, and the values between two points stay between the values at
/// these points.
#[derive(Debug, Clone, PartialEq)]
pub struct Pchip {
    points: Points,
    slopes: Vec<f64>,
}

impl From<Points> for Pchip {
    fn from(points: Points) -> Self {
        let n = points.times.len();
        let h = |i: usize| points.times[i + 1] - points.times[i];
        let slopes = (0..n).map(|i| match i {
            _ if n == 2 => points.slope(0),
            0 => end_slope([h(0), h(1)], [points.slope(0), points.slope(1)]),
            _ if i == n - 1 => {
                end_slope([h(n - 2), h(n - 3)], [points.slope(n - 2), points.slope(n - 3)])
            }
            _ => inner_slope([h(i - 1), h(i)], [points.slope(i - 1), points.slope(i)]),
        });
        Self { slopes: slopes.collect(), points }
    }
}

/// Returns the harmonic mean of the slopes of two neighboring intervals, weighted by their lengths;
/// 0 at an extremum.
fn inner_slope([h0, h1]: [f64; 2], [d0, d1]: [f64; 2]) -> f64 {
    if d0 * d1 <= 0.0 {
        return 0.0;
    }
    let (w0, w1) = (h0 + 2.0 * h1, 2.0 * h0 + h1);
    (w0 + w1) / (w0 / d0 + w1 / d1)
}

/// Returns the slope, at one end, of the parabola through three points. The slope is limited so that the interpolation
/// stays monotone in the interval.
fn end_slope([h0, h1]: [f64; 2], [d0, d1]: [f64; 2]) -> f64 {
    let slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    match () {
        () if slope * d0 <= 0.0 => 0.0,
        () if d0 * d1 <= 0.0 && slope.abs() > 3.0 * d0.abs() => 3.0 * d0,
        () => slope,
    }
}

impl TimeFunction for Pchip {
    fn at(&self, t: f64) -> Jet {
        let (points, i) = (&self.points, self.points.interval(t));
        let h = points.times[i + 1] - points.times[i];
        let (s, d) = (t - points.times[i], points.slope(i));
        let (m0, m1) = (self.slopes[i], self.slopes[i + 1]);
        let (c2, c3) = ((3.0 * d - 2.0 * m0 - m1) / h, (m0 + m1 - 2.0 * d) / (h * h));
        Jet {
            value: points.values[i] + s * (m0 + s * (c2 + s * c3)),
            d1: m0 + s * (2.0 * c2 + s * 3.0 * c3),
            d2: 2.0 * c2 + 6.0 * c3 * s,
        }
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        self.points.time_scale(from, to)
    }

    fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        self.points.constant_over(from, to)
    }

    fn lowest_jump(&self) -> u8 {
        2
    }

    fn range(&self) -> (f64, f64) {
        self.points.range()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Signal;

    const TIMES: [f64; 5] = [0.0, 1.0, 1.5, 3.0, 10.0];
    const VALUES: [f64; 5] = [0.0, 1000.0, 1000.0, -200.0, -200.0];

    fn points() -> Points {
        Points::new(TIMES.to_vec(), VALUES.to_vec()).unwrap()
    }

    #[test]
    fn wrong_tables_are_rejected() {
        for (times, values) in [
            (vec![0.0], vec![1.0]),
            (vec![0.0, 0.0], vec![1.0, 2.0]),
            (vec![1.0, 0.5], vec![1.0, 2.0]),
            (vec![0.0, 1.0], vec![1.0, f64::NAN]),
        ] {
            assert!(Points::new(times, values).is_err());
        }
    }

    /// Regression: the load curve (0, 0), (1, 1000), (10, 1000) gave 2556 at 5 s.
    #[test]
    fn a_ramp_with_a_hold_stays_within_its_data() {
        let ramp = Points::new(vec![0.0, 1.0, 10.0], vec![0.0, 1000.0, 1000.0]).unwrap();
        assert_eq!(Polyline(ramp.clone()).at(5.0), Jet::constant(1000.0));
        assert_eq!(Polyline(ramp.clone()).at(0.25).value, 250.0);
        assert_eq!(Pchip::from(ramp).at(5.0).value, 1000.0);
    }

    #[test]
    fn between_two_points_values_are_between_theirs_and_derivatives_match() {
        for signal in [Signal::from(Polyline(points())), Signal::from(Pchip::from(points()))] {
            for (t, value) in TIMES.iter().zip(VALUES) {
                // The last point has a rounding error, because it is evaluated from the start of its interval.
                assert!((signal.at(*t).value - value).abs() < 1e-12 * 1000.0);
            }
            for (t, y) in TIMES.windows(2).zip(VALUES.windows(2)) {
                for i in 1..50 {
                    let t = t[0] + (t[1] - t[0]) * f64::from(i) / 50.0;
                    let here = signal.at(t);
                    let (low, high) = (y[0].min(y[1]), y[0].max(y[1]));
                    assert!(here.value >= low - 1e-9 && here.value <= high + 1e-9, "{t}");
                    // The error of the central difference is h²/6 |f'''|, where |f'''| is below 1e5.
                    let h = 1e-5;
                    let slope = (signal.at(t + h).value - signal.at(t - h).value) / (2.0 * h);
                    assert!((slope - here.d1).abs() < 1e-4, "{t}");
                }
            }
        }
    }

    #[test]
    fn steps_end_at_kinks_and_constant_parts_are_known() {
        let lines = Signal::from(Polyline(points()));
        let breaks: Vec<_> = lines.breaks(-1.0, 20.0).map(|b| (b.t, b.order)).collect();
        assert_eq!(breaks, [(1.0, 1), (1.5, 1), (3.0, 1)]);
        assert_eq!(lines.lowest_jump(), 1);
        for (t, slopes) in [(1.0, [1000.0, 0.0]), (1.5, [0.0, -800.0]), (3.0, [-800.0, 0.0])] {
            assert_eq!([t, just_after(t)].map(|t| lines.at(t).d1), slopes);
        }
        assert_eq!(lines.constant_over(1.0, 1.5), Some(1000.0));
        assert_eq!(lines.constant_over(3.0, 9.0), Some(-200.0));
        assert_eq!(lines.constant_over(0.5, 1.2), None);
        let line = Points::new(vec![0.0, 1.0, 3.0], vec![1.0, 2.0, 4.0]).unwrap();
        assert_eq!(Polyline(line).lowest_jump(), 3);
        let smooth = Signal::from(Pchip::from(points()));
        assert_eq!(smooth.unfit_for_motion(), None);
        for t in TIMES {
            let (before, after) = (smooth.at(t - 1e-9), smooth.at(t + 1e-9));
            // The second derivative is below 1e4.
            assert!((before.d1 - after.d1).abs() < 2e-9 * 1e4 * 1.01, "{t}");
        }
    }
}

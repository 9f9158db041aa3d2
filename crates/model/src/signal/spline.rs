//! Cubic splines, which represent tables of values as functions with two continuous derivatives.

use super::jet::Jet;
use super::table::Points;
use super::timing::shortest;
use crate::error::ModelError;

/// Cubic spline through given points.
///
/// [`new`](Self::new) creates the natural spline, whose second derivative vanishes at both ends. Of all twice
/// differentiable functions through the points, it minimizes `∫ s''² dt`. Between two points, it may overshoot by a
/// fraction of the difference between their values. For a smooth function, its error is of order h⁴ in the interior and
/// h² near the ends. [`of_acceleration`](Self::of_acceleration) integrates a piecewise linear acceleration twice.
///
/// # Examples
/// ```
/// use myovib_model::Spline;
/// let line = Spline::new(vec![0.0, 1.0, 4.0], vec![1.0, 3.0, 9.0])?;
/// let here = line.at(2.0);
/// assert!((here.value - 5.0).abs() < 1e-14 && (here.d1 - 2.0).abs() < 1e-14);
/// # Ok::<(), myovib_model::ModelError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    points: Points,
    /// Second derivatives of the spline at the points.
    moments: Vec<f64>,
    /// The acceleration whose second integral is the spline, if any.
    acceleration: Option<Points>,
}

/// Part of a spline outside the range of the values at the two neighboring points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overshoot {
    /// Times of the two points, s.
    pub between: [f64; 2],
    /// Extreme value of the spline between the two points.
    pub value: f64,
    /// Amount by which the extreme value exceeds the values at the two points, as a fraction of the range of all
    /// values.
    pub excess: f64,
}

impl From<Points> for Spline {
    fn from(points: Points) -> Self {
        Self { moments: moments(&points.times, &points.values), points, acceleration: None }
    }
}

impl Spline {
    /// Creates the natural spline through `values` at ascending `times` (s).
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if there are fewer than two points, if the times are not ascending, or if a value is
    /// not finite.
    ///
    /// # Panics
    /// Panics if the lengths differ.
    pub fn new(times: Vec<f64>, values: Vec<f64>) -> Result<Self, ModelError> {
        Ok(Points::new(times, values)?.into())
    }

    /// Creates the displacement with an `acceleration` linear between its points. The motion starts at rest at
    /// t = 0.
    pub fn of_acceleration(acceleration: Points) -> Self {
        let Points { times, values: moments, .. } = acceleration.clone();
        let (mut values, mut velocity) = (vec![0.0], 0.0);
        for (t, a) in times.windows(2).zip(moments.windows(2)) {
            let h = t[1] - t[0];
            let moved = h * velocity + h * h * (2.0 * a[0] + a[1]) / 6.0;
            values.push(values[values.len() - 1] + moved);
            velocity += 0.5 * h * (a[0] + a[1]);
        }
        let spline_through = |times: Vec<f64>, values| Self {
            points: Points::spanning(times, values),
            moments: moments.clone(),
            acceleration: Some(acceleration.clone()),
        };
        let start = spline_through(times.clone(), values.clone()).at(0.0);
        for (value, t) in values.iter_mut().zip(&times) {
            *value -= start.value + start.d1 * t;
        }
        spline_through(times, values)
    }

    /// Returns the largest overshoot beyond the values at two neighboring points, if any.
    pub fn overshoot(&self) -> Option<Overshoot> {
        let Points { times, values, spread } = &self.points;
        let extremum = |i: usize| {
            let [t0, t1] = [times[i], times[i + 1]];
            let (low, high) = (values[i].min(values[i + 1]), values[i].max(values[i + 1]));
            // The slope is a parabola. With sixteen samples, the relative error of an extremum is the square of a
            // sixteenth.
            let inside = (1..16).map(|k| self.at(t0 + (t1 - t0) * f64::from(k) / 16.0).value);
            let beyond = inside.map(|y| ((y - high).max(low - y).max(0.0), y));
            let (excess, value) = beyond.max_by(|a, b| a.0.total_cmp(&b.0))?;
            Some(Overshoot { between: [t0, t1], value, excess: excess / spread })
        };
        let all = (0..times.len() - 1).filter_map(extremum);
        all.filter(|found| found.excess > 0.0).max_by(|a, b| a.excess.total_cmp(&b.excess))
    }

    /// Returns the first and the last time (s).
    pub fn range(&self) -> (f64, f64) {
        self.points.range()
    }

    /// Returns the time √(2 range/|s''|) (s), in which the largest curvature between two times changes the value by the
    /// range of the table. Returns `None` if the spline is straight. The integral of an acceleration may drift far;
    /// therefore, the time scale of the acceleration is returned if it is shorter.
    pub fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let place = |t: f64| self.points.times.partition_point(|&time| time <= t);
        let (first, last) = (place(from), place(to));
        // s'' is linear between the points.
        let inside = self.moments[first..last.max(first)].iter().copied();
        let ends = [self.at(from).d2, self.at(to).d2];
        let curvature = inside.chain(ends).fold(0.0, |m: f64, d2| m.max(d2.abs()));
        let own = (2.0 * self.points.spread / curvature).sqrt();
        let acceleration = self.acceleration.as_ref();
        let of_acceleration = acceleration.and_then(|points| points.time_scale(from, to));
        shortest(of_acceleration.into_iter().chain([own]))
    }

    /// Returns the value and the derivatives at time `t`. Beyond the ends, the first and last cubics are extended.
    pub fn at(&self, t: f64) -> Jet {
        let (Points { times, values, .. }, i) = (&self.points, self.points.interval(t));
        let h = times[i + 1] - times[i];
        let (a, b) = ((times[i + 1] - t) / h, (t - times[i]) / h);
        let (y0, y1) = (values[i], values[i + 1]);
        let (m0, m1) = (self.moments[i], self.moments[i + 1]);
        Jet {
            value: a * y0 + b * y1 + h * h / 6.0 * ((a * a * a - a) * m0 + (b * b * b - b) * m1),
            d1: (y1 - y0) / h + h / 6.0 * ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1),
            d2: a * m0 + b * m1,
        }
    }
}

/// Computes the second derivatives at the points from the continuity of the first derivative:
/// `h_i m_i + 2 (h_i + h_{i+1}) m_{i+1} + h_{i+1} m_{i+2} = 6 (slope_{i+1} - slope_i)`.
///
/// The matrix is tridiagonal and diagonally dominant, so elimination requires no pivoting.
fn moments(times: &[f64], values: &[f64]) -> Vec<f64> {
    let n = times.len();
    let h: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slope: Vec<f64> = values.windows(2).zip(&h).map(|(y, h)| (y[1] - y[0]) / h).collect();
    let mut upper = vec![0.0; n];
    let mut moments = vec![0.0; n];
    for i in 1..n - 1 {
        let pivot = 2.0 * (h[i - 1] + h[i]) - h[i - 1] * upper[i - 1];
        upper[i] = h[i] / pivot;
        moments[i] = (6.0 * (slope[i] - slope[i - 1]) - h[i - 1] * moments[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        moments[i] -= upper[i] * moments[i + 1];
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a vibration on a drift had the time scale of the drift, so steps missed the vibration.
    #[test]
    fn drift_does_not_hide_vibrations() {
        let times: Vec<f64> = (0..=1000).map(|i| 1e-3 * f64::from(i)).collect();
        let values = times.iter().map(|t| 2.0 + 10.0 * (314.0 * t).sin());
        let points = Points::new(times.clone(), values.collect()).unwrap();
        let displacement = Spline::of_acceleration(points);
        // The drift is about 1 m; the vibration has a period of 0.02 s.
        let scale = displacement.time_scale(0.5, 0.9).unwrap();
        assert!(scale < 0.02, "{scale}");
    }

    #[test]
    fn it_passes_through_its_points_with_two_continuous_derivatives() {
        let times = vec![0.0, 0.3, 1.0, 1.1, 2.0];
        let values = vec![1.0, -2.0, 0.5, 0.7, 3.0];
        let spline = Spline::new(times.clone(), values.clone()).unwrap();
        for (t, y) in times.iter().zip(&values) {
            assert!((spline.at(*t).value - y).abs() < 1e-14);
        }
        for t in &times[1..4] {
            let (before, after) = (spline.at(t - 1e-9), spline.at(t + 1e-9));
            // Third derivatives are below 1e4 here, so values 2e-9 apart differ by at most 1e-4.
            assert!((before.d1 - after.d1).abs() < 1e-5 && (before.d2 - after.d2).abs() < 1e-4);
        }
        assert!(spline.at(0.0).d2.abs() < 1e-12 && spline.at(2.0).d2.abs() < 1e-12);
    }

    #[test]
    fn it_converges_with_order_four_to_a_sine() {
        // The sine's second derivative vanishes at both ends, so no order is lost there.
        let error = |n: usize| {
            let times: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
            let sine = |t: f64| (std::f64::consts::PI * t).sin();
            let spline = Spline::new(times.clone(), times.iter().map(|&t| sine(t)).collect());
            let spline = spline.unwrap();
            (0..1000)
                .map(|i| f64::from(i) / 1000.0)
                .fold(0.0_f64, |worst, t| worst.max((spline.at(t).value - sine(t)).abs()))
        };
        let order = (error(10) / error(20)).log2();
        assert!((order - 4.0).abs() < 0.1, "order {order}");
    }

    /// The natural spline through (0, 0), (1, 1000), (10, 1000) has the second derivatives 0, −300, 0.
    #[test]
    fn overshoot_is_the_part_beyond_the_neighboring_points() {
        let ramp = Spline::new(vec![0.0, 1.0, 10.0], vec![0.0, 1000.0, 1000.0]).unwrap();
        let found = ramp.overshoot().unwrap();
        assert_eq!(found.between, [1.0, 10.0]);
        let largest = (0..=900).map(|i| ramp.at(1.0 + 0.01 * f64::from(i)).value);
        let expected = (largest.fold(0.0, f64::max) - 1000.0) / 1000.0;
        // The maximum is at most 9/32 s away, where the value has fallen by 300/2 (9/32)² = 12.
        assert!(found.excess <= expected && found.excess > expected - 12e-3);
        let line = Spline::new(vec![0.0, 1.0, 3.0], vec![0.0, 1.0, 3.0]).unwrap();
        assert_eq!(line.overshoot(), None);
    }
}

//! Natural cubic splines: tables of values as functions with two continuous derivatives.

use super::jet::Jet;
use super::timing::shortest;
use crate::error::ModelError;

/// The interpolating cubic spline whose second derivative vanishes at both ends.
///
/// Among all functions through the points it bends least, `∫ s''² dt` being minimal; between
/// points it may overshoot by a fraction of their difference. Its error for a smooth function is
/// of order h⁴ inside and h² next to the ends.
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
    times: Vec<f64>,
    values: Vec<f64>,
    /// Second derivatives at the points.
    moments: Vec<f64>,
    /// Largest less smallest value.
    spread: f64,
}

impl Spline {
    /// The spline through `values` at ascending `times` (s).
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] for fewer than two points, times that do not ascend, or what is
    /// not finite.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn new(times: Vec<f64>, values: Vec<f64>) -> Result<Self, ModelError> {
        assert_eq!(times.len(), values.len(), "a value for each time");
        let fail = |name, value, allowed| {
            Err(ModelError::OutOfRange {
                name,
                value,
                allowed,
            })
        };
        if times.len() < 2 {
            return fail("rows of a table", times.len() as f64, "2 or more");
        }
        if let Some(bad) = times.iter().chain(&values).find(|x| !x.is_finite()) {
            return fail("number in a table", *bad, "finite");
        }
        if let Some(pair) = times.windows(2).find(|pair| pair[1] <= pair[0]) {
            return fail("time in a table", pair[1], "greater than the one before it");
        }
        let moments = moments(&times, &values);
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        Ok(Self {
            spread: largest - smallest,
            times,
            values,
            moments,
        })
    }

    /// First and last time, s.
    pub fn range(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// The time in which the curvature it has between two times, at its largest, changes it by the
    /// range of its values, √(2 range/|s''|), s; none where it is straight.
    pub fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let place = |t: f64| self.times.partition_point(|&time| time <= t);
        let (first, last) = (place(from), place(to));
        // s'' is linear between the points.
        let inside = self.moments[first..last.max(first)].iter().copied();
        let ends = [self.at(from).d2, self.at(to).d2];
        let curvature = inside.chain(ends).fold(0.0, |m: f64, d2| m.max(d2.abs()));
        shortest([(2.0 * self.spread / curvature).sqrt()])
    }

    /// Value and derivatives at time `t`; beyond the ends the first and last cubic go on.
    pub fn at(&self, t: f64) -> Jet {
        let last = self.times.len() - 2;
        let i = self
            .times
            .partition_point(|&start| start <= t)
            .saturating_sub(1)
            .min(last);
        let h = self.times[i + 1] - self.times[i];
        let (a, b) = ((self.times[i + 1] - t) / h, (t - self.times[i]) / h);
        let (y0, y1) = (self.values[i], self.values[i + 1]);
        let (m0, m1) = (self.moments[i], self.moments[i + 1]);
        Jet {
            value: a * y0 + b * y1 + h * h / 6.0 * ((a * a * a - a) * m0 + (b * b * b - b) * m1),
            d1: (y1 - y0) / h + h / 6.0 * ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1),
            d2: a * m0 + b * m1,
        }
    }
}

/// Second derivatives at the points, from the continuity of the first:
/// `h_i m_i + 2 (h_i + h_{i+1}) m_{i+1} + h_{i+1} m_{i+2} = 6 (slope_{i+1} - slope_i)`.
///
/// The matrix is tridiagonal and diagonally dominant: elimination needs no pivoting.
fn moments(times: &[f64], values: &[f64]) -> Vec<f64> {
    let n = times.len();
    let h: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slope: Vec<f64> = values
        .windows(2)
        .zip(&h)
        .map(|(y, h)| (y[1] - y[0]) / h)
        .collect();
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
            // Third derivatives are below 1e4 here, so 2e-9 away nothing moves by more than 1e-4.
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
                .fold(0.0_f64, |worst, t| {
                    worst.max((spline.at(t).value - sine(t)).abs())
                })
        };
        let order = (error(10) / error(20)).log2();
        assert!((order - 4.0).abs() < 0.1, "order {order}");
    }

    #[test]
    fn wrong_tables_are_refused() {
        for (times, values) in [
            (vec![0.0], vec![1.0]),
            (vec![0.0, 0.0], vec![1.0, 2.0]),
            (vec![1.0, 0.5], vec![1.0, 2.0]),
            (vec![0.0, 1.0], vec![1.0, f64::NAN]),
        ] {
            assert!(Spline::new(times, values).is_err());
        }
    }
}

//! A body's motion at a point, kept as the integrator's own polynomials.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use crate::error::ModelError;
use crate::integration::run::{Observer, Step};
use crate::integration::statistics::Outcome;
use crate::reading::displacement::Displacement;
use crate::signal::timing::{Break, FRACTION, Timed, shortest};

/// Points per step: they determine a polynomial of degree 8, that of the dense output of Radau IIA
/// with seven stages; the BDF's has 5 at most.
const POINTS: usize = 9;

/// Chebyshev points of the second kind on [0, 1], from the start of a step to its end.
fn place(k: usize) -> f64 {
    let angle = PI * k as f64 / (POINTS - 1) as f64;
    (1.0 - angle.cos()) / 2.0
}

/// The displacement at a point over a run, exact between the steps as at them.
///
/// Each accepted step keeps the values of its interpolating polynomial at nine points, which
/// determine it: no sampling error is added to that of the integrator, whatever its steps.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    start: f64,
    /// Ends of the steps, ascending.
    ends: Vec<f64>,
    values: Vec<[f64; POINTS]>,
    prescribed: Displacement,
    /// Smallest and largest value, of what is not prescribed.
    extent: Option<[f64; 2]>,
}

impl Recording {
    /// The times covered, s; `None` while nothing is recorded.
    pub fn covers(&self) -> Option<[f64; 2]> {
        self.ends.last().map(|end| [self.start, *end])
    }

    /// Number of steps recorded.
    pub fn n_steps(&self) -> usize {
        self.ends.len()
    }

    /// u at time `t`; `None` outside the times covered.
    pub fn at(&self, t: f64) -> Option<f64> {
        let [start, end] = self.covers()?;
        // An integrator asked to stop at the end may overshoot it by rounding.
        let slack = 1e-12 * (end - start);
        if !(start - slack..=end + slack).contains(&t) {
            return None;
        }
        let step = self
            .ends
            .partition_point(|e| *e < t)
            .min(self.ends.len() - 1);
        let from = if step == 0 {
            start
        } else {
            self.ends[step - 1]
        };
        let place = (t - from) / (self.ends[step] - from);
        Some(interpolate(&self.values[step], place) + self.prescribed.prescribed_at(t))
    }
}

impl Timed for Arc<Recording> {
    /// That of what was prescribed at the point.
    fn next_break(&self, after: f64) -> Option<Break> {
        let prescribed = self.prescribed.prescribed.iter();
        let breaks = prescribed.filter_map(|(signal, _)| signal.next_break(after));
        breaks.reduce(Break::earlier)
    }

    /// The period of a sine with the range and the largest curvature of the motion between the
    /// two times, π √(2 range/|ü|): a motion has inertia, and no more than that within a step.
    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let [low, high] = self.extent?;
        let first = self.ends.partition_point(|end| *end <= from);
        let last = self.ends.partition_point(|end| *end < to);
        let starts = std::iter::once(&self.start).chain(&self.ends);
        let steps = starts.zip(&self.ends).zip(&self.values);
        let curvatures = steps
            .take(last + 1)
            .skip(first)
            .map(|((start, end), values)| curvature(values) / (end - start).powi(2));
        let largest = curvatures.fold(0.0, f64::max);
        let own = PI * (2.0 * (high - low) / largest).sqrt();
        let prescribed = self.prescribed.prescribed.iter();
        let given = prescribed.filter_map(|(signal, _)| signal.time_scale(from, to));
        shortest(given.chain([own]))
    }

    fn longest_step(&self, from: f64, to: f64) -> Option<f64> {
        Some(FRACTION * self.time_scale(from, to)?)
    }
}

/// The curvature of the polynomial through `values` at the Chebyshev points of an interval of
/// length 1, from its distance to the chord: x (1 − x)/2 for a curvature of 1.
fn curvature(values: &[f64; POINTS]) -> f64 {
    let (first, last) = (values[0], values[POINTS - 1]);
    let sagitta = values.iter().enumerate().map(|(k, value)| {
        let x = place(k);
        (value - (1.0 - x) * first - x * last).abs()
    });
    8.0 * sagitta.fold(0.0, f64::max)
}

/// The polynomial through `values` at the Chebyshev points, by the barycentric formula.
fn interpolate(values: &[f64; POINTS], x: f64) -> f64 {
    let (mut numerator, mut denominator) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let distance = x - place(k);
        if distance == 0.0 {
            return *value;
        }
        let half = if k == 0 || k == POINTS - 1 { 0.5 } else { 1.0 };
        let weight = half * if k % 2 == 0 { 1.0 } else { -1.0 } / distance;
        numerator += weight * value;
        denominator += weight;
    }
    numerator / denominator
}

/// Records the displacement at a point step by step.
pub struct Recorder {
    point: Displacement,
    recording: Recording,
    y: Vec<f64>,
}

impl Recorder {
    /// Records `point` of a system of `n` unknowns.
    pub fn new(point: Displacement, n: usize) -> Self {
        let recording = Recording {
            prescribed: Displacement {
                unknowns: Vec::new(),
                prescribed: point.prescribed.clone(),
            },
            ..Recording::default()
        };
        Self {
            point,
            recording,
            y: vec![0.0; n],
        }
    }

    /// What was recorded.
    pub fn finish(self) -> Recording {
        self.recording
    }
}

impl<P> Observer<P> for Recorder {
    fn accepted(&mut self, step: &mut Step<'_, P>) -> Result<ControlFlow<Outcome>, ModelError> {
        let recording = &mut self.recording;
        if recording.ends.is_empty() {
            recording.start = step.from;
        }
        let mut values = [0.0; POINTS];
        for (k, value) in values.iter_mut().enumerate() {
            let t = step.from + place(k) * (step.to - step.from);
            step.integrator.dense_output(t, 0, &mut self.y)?;
            *value = self.point.of(&self.y);
        }
        let [low, high] = recording.extent.unwrap_or([values[0]; 2]);
        recording.extent = Some([
            values.iter().copied().fold(low, f64::min),
            values.iter().copied().fold(high, f64::max),
        ]);
        recording.ends.push(step.to);
        recording.values.push(values);
        Ok(ControlFlow::Continue(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_degree_eight_is_reproduced() {
        let coefficients = [1.0, 2.0, -3.0, 0.5, 4.0, -2.5, 1.0, -3.0, 2.0];
        let p = |x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let values = std::array::from_fn(|k| p(place(k)));
        for x in [0.0, 0.1, 0.37, 0.5, 0.93, 1.0] {
            // The values are of size 1, the interpolation's condition on nine points below 3.
            assert!((interpolate(&values, x) - p(x)).abs() < 20.0 * f64::EPSILON);
        }
    }

    #[test]
    fn there_is_no_motion_outside_the_times_covered() {
        let recording = Recording {
            start: 1.0,
            ends: vec![1.5, 2.0],
            values: vec![[3.0; POINTS], [4.0; POINTS]],
            prescribed: Displacement::default(),
            extent: Some([3.0, 4.0]),
        };
        assert_eq!(recording.at(0.9), None);
        assert_eq!(recording.at(2.1), None);
        // The weights of the interpolation add up to 1 to rounding.
        for (t, value) in [(1.2, 3.0), (1.7, 4.0)] {
            let found = recording.at(t).unwrap();
            assert!((found - value).abs() < 10.0 * f64::EPSILON * value);
        }
        assert_eq!(Recording::default().at(0.0), None);
    }
}

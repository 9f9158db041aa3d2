//! Motion of a point of a body, stored as the integrator's interpolating polynomials.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::chebyshev;
use crate::error::ModelError;
use crate::integration::run::{AcceptedStep, Observer};
use crate::integration::statistics::Outcome;
use crate::reading::displacement::Displacement;
use crate::signal::timing::{Break, FRACTION, TimeScales, shortest};

/// Number of points per step. The points determine a polynomial of degree 8, which is the degree of the dense output
/// of Radau IIA with seven stages. The degree of the dense output of BDF is at most 5.
pub(super) const POINTS: usize = 9;

/// Returns Chebyshev point `k`, ordered from the start of a step (0) to its end (1).
fn place(k: usize) -> f64 {
    chebyshev::points(POINTS)[k]
}

/// Displacement at a point over a run, with the accuracy of the dense output.
///
/// For each accepted step, the values of the interpolating polynomial at nine points are stored. These values
/// determine the polynomial, so recording adds no sampling error, regardless of the step size.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    start: f64,
    /// End times of the steps in ascending order.
    ends: Vec<f64>,
    values: Vec<[f64; POINTS]>,
    prescribed: Displacement,
    /// Minimum and maximum of the displacement without the prescribed motion; `None` if nothing is recorded.
    extent: Option<[f64; 2]>,
}

impl Recording {
    /// Returns the recorded time interval, s, or `None` if the recording is empty.
    pub fn covers(&self) -> Option<[f64; 2]> {
        self.ends.last().map(|end| [self.start, *end])
    }

    /// Returns the number of recorded steps.
    pub fn n_steps(&self) -> usize {
        self.ends.len()
    }

    /// Returns u at time `t`, or `None` outside the recorded interval.
    pub fn at(&self, t: f64) -> Option<f64> {
        let [start, end] = self.covers()?;
        // An integrator that stops at the end may exceed it by a rounding error.
        let slack = 1e-12 * (end - start);
        if !(start - slack..=end + slack).contains(&t) {
            return None;
        }
        let step = self.ends.partition_point(|e| *e < t).min(self.ends.len() - 1);
        let from = if step == 0 { start } else { self.ends[step - 1] };
        let place = (t - from) / (self.ends[step] - from);
        Some(chebyshev::interpolate(&self.values[step], place) + self.prescribed.prescribed_at(t))
    }
}

impl TimeScales for Arc<Recording> {
    /// Returns the next break of the prescribed motion of the point.
    fn next_break(&self, after: f64) -> Option<Break> {
        let prescribed = self.prescribed.prescribed.iter();
        let breaks = prescribed.filter_map(|(signal, _)| signal.next_break(after));
        breaks.reduce(Break::earlier)
    }

    /// Returns the period π √(2 range/|ü|) of a sine with the range of the motion and the largest acceleration between
    /// the two times, or the time scale of the prescribed motion if it is shorter. Inertia prevents faster motions
    /// within a step.
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

    fn is_resolved(&self, _: f64, _: f64) -> bool {
        true
    }
}

/// Estimates the magnitude of the second derivative of a polynomial on [0, 1] from its values at the Chebyshev points.
/// If the second derivative is 1, the distance to the chord is x (1 − x)/2.
fn curvature(values: &[f64; POINTS]) -> f64 {
    let (first, last) = (values[0], values[POINTS - 1]);
    let sagitta = values.iter().enumerate().map(|(k, value)| {
        let x = place(k);
        (value - (1.0 - x) * first - x * last).abs()
    });
    8.0 * sagitta.fold(0.0, f64::max)
}

/// Records the displacement at a point step by step.
pub struct Recorder {
    point: Displacement,
    recording: Recording,
    y: Vec<f64>,
}

impl Recorder {
    /// Creates a recorder for `point` of a system of `n` unknowns.
    pub fn new(point: Displacement, n: usize) -> Self {
        let recording = Recording {
            prescribed: Displacement { unknowns: Vec::new(), prescribed: point.prescribed.clone() },
            ..Recording::default()
        };
        Self { point, recording, y: vec![0.0; n] }
    }

    /// Returns the recording.
    pub fn finish(self) -> Recording {
        self.recording
    }
}

impl<P> Observer<P> for Recorder {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
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
    fn recordings_reject_times_outside_their_range() {
        let recording = Recording {
            start: 1.0,
            ends: vec![1.5, 2.0],
            values: vec![[3.0; POINTS], [4.0; POINTS]],
            prescribed: Displacement::default(),
            extent: Some([3.0, 4.0]),
        };
        assert_eq!(recording.at(0.9), None);
        assert_eq!(recording.at(2.1), None);
        // The interpolation weights sum to 1 up to rounding.
        for (t, value) in [(1.2, 3.0), (1.7, 4.0)] {
            let found = recording.at(t).unwrap();
            assert!((found - value).abs() < 10.0 * f64::EPSILON * value);
        }
        assert_eq!(Recording::default().at(0.0), None);
    }
}

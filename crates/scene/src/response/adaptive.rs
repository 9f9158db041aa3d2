//! Adaptive choice of the frequencies at which a response is computed.
//!
//! A rational function interpolates the computed responses. In each round, new responses are computed at frequencies
//! where this function differs most from the function of the previous round. They are then compared with the
//! predictions of the interpolation. The rounds end when all new responses are predicted within the tolerance. Finally,
//! each peak and its half-power frequencies are added.

use num_complex::Complex64;

use super::peaks::{Maximum, damping_ratio, is_constant, maximum};
use super::rational::Rational;
use crate::scene_file::response::Adaptive;

const FIRST_ROUND: usize = 12;
/// Maximum number of frequencies in each later round.
const ROUND: usize = 6;
/// Number of predictions between adjacent computed frequencies.
const PREDICTIONS_PER_INTERVAL: usize = 24;
/// Number of intervals into which plots divide the range between adjacent frequencies.
const DRAWN: usize = 8;
pub const MAX_FREQUENCIES: usize = 400;
/// Fraction of the size of a curve. For amplitudes below this fraction (near zeros of the curve), the tolerance is
/// absolute.
const SMALL: f64 = 0.01;
/// Minimum size attributed to a curve, relative to the largest curve of the same kind. With this value, rounding errors
/// stay below a tolerance of 1e-6.
const WEAKEST: f64 = 1e-5;
/// Minimum distance between computed frequencies near a peak, as a fraction of half the half-power width. Within this
/// distance, the amplitudes differ by less than the default tolerance.
const MIN_DISTANCE: f64 = 0.03;
/// If the ratio of the ends of the range is above this value, the first frequencies are spaced logarithmically.
const WIDE: f64 = 30.0;

/// Amplitudes at ascending frequencies.
pub(super) struct Samples {
    pub(super) frequencies: Vec<f64>,
    /// Amplitudes of all curves at each frequency.
    pub(super) rows: Vec<Vec<Complex64>>,
    /// Largest prediction error in the last round; `None` if no round with predictions was completed.
    pub(super) error: Option<f64>,
    /// Local maxima of the curves, each with the zero-based index of its curve.
    pub(super) peaks: Vec<(usize, Maximum)>,
    /// Frequencies and amplitudes of the rational function, for smooth plots.
    pub(super) drawn: Option<(Vec<f64>, Vec<Vec<Complex64>>)>,
}

impl Samples {
    /// Creates samples at given frequencies, which must be in ascending order.
    pub(super) fn given(frequencies: Vec<f64>, rows: Vec<Vec<Complex64>>) -> Self {
        Self { frequencies, rows, error: None, peaks: Vec::new(), drawn: None }
    }

    fn add(&mut self, frequencies: &[f64], rows: Vec<Vec<Complex64>>) {
        for (f, row) in frequencies.iter().zip(rows) {
            let place = self.frequencies.partition_point(|other| other < f);
            self.frequencies.insert(place, *f);
            self.rows.insert(place, row);
        }
    }

    fn with_curves(mut self, fitted: &Rational, peaks: Vec<(usize, Maximum)>) -> Self {
        let n_curves = self.rows.first().map_or(0, Vec::len);
        let frequencies = refined(&self.frequencies, DRAWN);
        let rows = frequencies.iter().map(|f| fitted.at(*f, n_curves)).collect();
        self.drawn = Some((frequencies, rows));
        self.peaks = peaks;
        self
    }

    /// Returns the size of each curve. The size is the median amplitude, but at least `WEAKEST` times the largest
    /// median of the same kind. It is 0 for curves that contain only rounding errors.
    fn sizes(&self, kinds: &[usize]) -> Vec<f64> {
        let amplitudes = |k: usize| {
            let mut all: Vec<f64> = self.rows.iter().map(|row| row[k].norm()).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let curves: Vec<Vec<f64>> = (0..kinds.len()).map(amplitudes).collect();
        let of_kind = |kind: usize, of: &dyn Fn(&Vec<f64>) -> f64| {
            let alike = curves.iter().zip(kinds).filter(|(_, other)| **other == kind);
            alike.map(|(curve, _)| of(curve)).fold(0.0, f64::max)
        };
        let largest = |curve: &Vec<f64>| curve.last().copied().unwrap_or(0.0);
        let median = |curve: &Vec<f64>| curve.get(curve.len() / 2).copied().unwrap_or(0.0);
        let size = |(curve, kind): (&Vec<f64>, &usize)| {
            if largest(curve) > super::ROUNDING * of_kind(*kind, &largest) {
                median(curve).max(WEAKEST * of_kind(*kind, &median))
            } else {
                0.0
            }
        };
        curves.iter().zip(kinds).map(size).collect()
    }
}

impl Adaptive {
    /// Computes the responses. `kinds` contains the kind of each curve; curves of the same kind have the same unit.
    /// `compute` returns the amplitudes at ascending frequencies, or at fewer frequencies if it was interrupted.
    ///
    /// Each round predicts its responses with `earlier`, the function fitted to the previous rounds, and then fits
    /// `fitted` to all responses. The difference between the two functions determines the frequencies of the next
    /// round.
    pub(super) fn resolve<E>(
        &self,
        kinds: &[usize],
        mut compute: impl FnMut(&[f64]) -> Result<(Vec<f64>, Vec<Vec<Complex64>>), E>,
    ) -> Result<Samples, E> {
        let mut samples = Samples::given(Vec::new(), Vec::new());
        let mut wanted = self.first();
        let mut earlier: Option<Rational> = None;
        let mut has_peaks = false;
        loop {
            let (frequencies, rows) = compute(&wanted)?;
            let is_interrupted = frequencies.len() < wanted.len();
            if let Some(prediction) = &earlier
                && !is_interrupted
            {
                let sizes = samples.sizes(kinds);
                let errors = frequencies
                    .iter()
                    .zip(&rows)
                    .map(|(f, row)| distance(&prediction.at(*f, kinds.len()), row, &sizes));
                samples.error = Some(errors.fold(0.0, f64::max));
            }
            samples.add(&frequencies, rows);
            let sizes = samples.sizes(kinds);
            let fitted = Rational::fit(&samples.frequencies, &samples.rows, &sizes);
            let peaks = peaks(&samples.frequencies, &fitted, &sizes);
            if is_interrupted || samples.frequencies.len() >= MAX_FREQUENCIES {
                return Ok(samples.with_curves(&fitted, peaks));
            }
            let before = earlier.unwrap_or_else(|| {
                let every_second = |n: usize| (0..n).step_by(2);
                let n = samples.frequencies.len();
                let f: Vec<f64> = every_second(n).map(|k| samples.frequencies[k]).collect();
                let rows: Vec<_> = every_second(n).map(|k| samples.rows[k].clone()).collect();
                Rational::fit(&f, &rows, &sizes)
            });
            let is_predicted = samples.error.is_some_and(|error| error <= self.tolerance);
            wanted =
                self.least_certain(&samples.frequencies, &fitted, &before, &sizes, is_predicted);
            if wanted.is_empty() && !has_peaks {
                has_peaks = true;
                wanted = self.near(&peaks, &samples.frequencies);
            }
            if wanted.is_empty() {
                return Ok(samples.with_curves(&fitted, peaks));
            }
            earlier = Some(fitted);
        }
    }

    fn first(&self) -> Vec<f64> {
        let [low, high] = self.range;
        let is_wide = low > 0.0 && high > WIDE * low;
        let place = |k: usize| {
            let s = k as f64 / (FIRST_ROUND - 1) as f64;
            match k {
                0 => low,
                _ if k == FIRST_ROUND - 1 => high,
                _ if is_wide => low * (high / low).powf(s),
                _ => low + s * (high - low),
            }
        };
        (0..FIRST_ROUND).map(place).collect()
    }

    /// Returns the frequencies at which two predictions differ most, in ascending order. At most one frequency is
    /// between two adjacent computed frequencies. If the responses of the last round were predicted within the
    /// tolerance, returns only frequencies at which the difference exceeds the tolerance.
    fn least_certain(
        &self,
        computed: &[f64],
        fitted: &Rational,
        before: &Rational,
        sizes: &[f64],
        is_predicted: bool,
    ) -> Vec<f64> {
        let gaps = computed.windows(2).map(|ends| {
            let between = (1..=PREDICTIONS_PER_INTERVAL).map(|i| {
                let f = ends[0]
                    + (ends[1] - ends[0]) * i as f64 / (PREDICTIONS_PER_INTERVAL + 1) as f64;
                let now = fitted.at(f, sizes.len());
                (f, distance(&before.at(f, sizes.len()), &now, sizes))
            });
            between.fold((ends[0], 0.0), |worst, one| if one.1 > worst.1 { one } else { worst })
        });
        let mut gaps: Vec<(f64, f64)> = gaps.collect();
        gaps.sort_by(|a, b| b.1.total_cmp(&a.1));
        let least = if is_predicted { self.tolerance } else { 0.0 };
        let wanted = gaps.iter().filter(|(_, difference)| *difference > least);
        let mut wanted: Vec<f64> = wanted.take(ROUND).map(|(f, _)| *f).collect();
        wanted.sort_by(f64::total_cmp);
        wanted
    }

    /// Returns the frequencies of the peaks and their half-power frequencies, in ascending order. Frequencies near
    /// already computed frequencies are excluded.
    fn near(&self, peaks: &[(usize, Maximum)], computed: &[f64]) -> Vec<f64> {
        let [low, high] = self.range;
        let mut wanted = Vec::new();
        for (_, peak) in peaks {
            let half_width = peak.damping_ratio.map_or(0.0, |ratio| ratio * peak.frequency);
            let nearby = match half_width {
                0.0 => 1e-4 * (high - low),
                _ => MIN_DISTANCE * half_width,
            };
            let places = [-half_width, 0.0, half_width].map(|shift| peak.frequency + shift);
            wanted.extend(places.map(|f| (f, nearby)));
        }
        wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
        wanted.dedup_by(|a, b| (a.0 - b.0).abs() < a.1.min(b.1));
        wanted.retain(|(f, nearby)| {
            (low..=high).contains(f) && computed.iter().all(|other| (f - other).abs() > *nearby)
        });
        wanted.into_iter().map(|(f, _)| f).collect()
    }
}

/// Divides each interval between adjacent frequencies into `n` equal parts.
fn refined(frequencies: &[f64], n: usize) -> Vec<f64> {
    let between = |ends: &[f64]| {
        let [low, high] = [ends[0], ends[1]];
        (0..n).map(move |i| low + (high - low) * i as f64 / n as f64)
    };
    let last = frequencies.last().copied();
    frequencies.windows(2).flat_map(between).chain(last).collect()
}

/// Returns the local maxima of the curves of a rational function between the computed frequencies.
fn peaks(computed: &[f64], fitted: &Rational, sizes: &[f64]) -> Vec<(usize, Maximum)> {
    let fine = refined(computed, PREDICTIONS_PER_INTERVAL);
    let rows: Vec<Vec<Complex64>> = fine.iter().map(|f| fitted.at(*f, sizes.len())).collect();
    let mut peaks = Vec::new();
    for (curve, size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0.0) {
        let amplitude = |k: usize| rows[k][curve].norm();
        if is_constant((0..fine.len()).map(amplitude)) {
            continue;
        }
        let own = fitted.of_curve(curve);
        let value = |f: f64| own.at(f, 1)[0];
        let exact = |f: f64| value(f).norm();
        for k in 1..fine.len().saturating_sub(1) {
            let here = amplitude(k);
            if here <= SMALL * size || amplitude(k - 1) >= here || here < amplitude(k + 1) {
                continue;
            }
            let frequency = maximum(exact, fine[k - 1], fine[k + 1]);
            let amplitude_there = exact(frequency);
            let half = amplitude_there / 2.0_f64.sqrt();
            let below = (0..k).rev().find(|&j| amplitude(j) <= half);
            let above = (k + 1..fine.len()).find(|&j| amplitude(j) <= half);
            let ends = [below, above].map(|end| Some(fine[end?]));
            let damping_ratio = damping_ratio(value, frequency, ends);
            peaks.push((curve, Maximum { frequency, amplitude: amplitude_there, damping_ratio }));
        }
    }
    peaks
}

/// Returns the largest difference between `values` and `exact`. Each difference is relative to the amplitude or, if
/// this is larger, to `SMALL` times the size of the curve.
fn distance(values: &[Complex64], exact: &[Complex64], sizes: &[f64]) -> f64 {
    let differences = values.iter().zip(exact).zip(sizes);
    let differences = differences.filter(|(_, size)| **size > 0.0);
    differences.fold(0.0, |largest, ((a, b), size)| {
        let difference = (a - b).norm() / b.norm().max(SMALL * size);
        if difference > largest || difference.is_nan() { difference } else { largest }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a sum of 8 lightly damped modes between 1 and 60 Hz. The third mode has a half-power width of 0.02 Hz.
    fn modes(f: f64) -> Vec<Complex64> {
        let mode = |f0: f64, zeta: f64, size: f64| {
            size * f0 * f0 / Complex64::new(f0 * f0 - f * f, 2.0 * zeta * f0 * f)
        };
        let all = [
            (3.0, 0.05, 1.0),
            (7.3, 0.02, 0.7),
            (10.0, 0.001, 0.1),
            (17.0, 0.03, 0.5),
            (24.0, 0.01, 0.3),
            (33.0, 0.04, 0.2),
            (45.0, 0.02, 0.2),
            (58.0, 0.03, 0.1),
            (90.0, 0.03, 0.1),
        ];
        let sum = |sign: f64| {
            let terms = all.iter().enumerate().map(|(k, &(f0, zeta, size))| {
                (if k % 2 == 1 { sign } else { 1.0 }) * mode(f0, zeta, size)
            });
            terms.sum::<Complex64>()
        };
        vec![sum(1.0), sum(-1.0)]
    }

    #[test]
    fn all_peaks_are_resolved_with_few_frequencies() {
        let adaptive = Adaptive { range: [1.0, 60.0], tolerance: 1e-3 };
        let compute = |f: &[f64]| Ok::<_, ()>((f.to_vec(), f.iter().map(|f| modes(*f)).collect()));
        let samples = adaptive.resolve(&[0, 0], compute).unwrap();
        assert!(samples.error.unwrap() <= adaptive.tolerance, "{:?}", samples.error);
        let sizes = samples.sizes(&[0, 0]);
        let fitted = Rational::fit(&samples.frequencies, &samples.rows, &sizes);
        let largest = (0..59_000).map(|i| {
            let f = 1.0 + 1e-3 * f64::from(i);
            distance(&fitted.at(f, 2), &modes(f), &sizes)
        });
        let largest = largest.fold(0.0, f64::max);
        assert!(largest < adaptive.tolerance, "{largest}");
        assert!(samples.frequencies.len() < 100, "{}", samples.frequencies.len());
        // At least one computed frequency is within the half-power width of the narrow peak.
        assert!(samples.frequencies.iter().any(|f| (f - 10.0).abs() < 0.01));
    }

    #[test]
    fn an_interrupted_round_keeps_its_responses() {
        let adaptive = Adaptive { range: [1.0, 60.0], tolerance: 1e-3 };
        let mut rounds = 0;
        let samples = adaptive.resolve(&[0, 0], |f| {
            rounds += 1;
            let n = if rounds == 2 { 1 } else { f.len() };
            Ok::<_, ()>((f[..n].to_vec(), f[..n].iter().map(|f| modes(*f)).collect()))
        });
        assert_eq!((samples.unwrap().frequencies.len(), rounds), (FIRST_ROUND + 1, 2));
    }
}

//! Peaks of response curves between the computed frequencies.
//!
//! With Rayleigh, Kelvin–Voigt and Prony damping, amplitudes are rational functions of the frequency. Therefore, each
//! curve is interpolated near a peak by a rational function.

use num_complex::Complex64;
use serde::Serialize;

use super::rational::Rational;

/// Minimum and maximum number of computed frequencies from which a peak is interpolated. Both are odd. An interpolant
/// through two samples fewer is used for an error estimate.
const SAMPLES: [usize; 2] = [7, 9];
/// A peak counts as resolved if the peaks of the two interpolants differ by at most this relative amount.
const RESOLVED: f64 = 1e-2;
/// Relative variation up to which an amplitude counts as constant. It covers rounding errors of the solutions and of
/// the interpolation.
const CONSTANT: f64 = 1e-6;
/// Allowed change of the phase (degrees) between a half-power frequency and the maximum of a resonance. It is 45° for
/// light damping and at most 52° for a damping ratio of 0.3. Nearby modes alter it.
const RESONANCE: std::ops::RangeInclusive<f64> = 22.5..=67.5;
/// Number of intervals on each side of a peak in which the half-power frequencies are searched for.
const SEARCH: usize = 400;

/// A local maximum of the amplitude of a value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Peak {
    pub probe: String,
    pub column: String,
    /// Frequency (Hz).
    pub frequency: f64,
    pub amplitude: f64,
    /// Damping ratio Δf/(2f) from the half-power width Δf. Null if the width is not resolved or if the phase does not
    /// change as at a resonance.
    pub damping_ratio: Option<f64>,
    /// The mode whose contribution to the value bends most sharply at the peak, which need not be a resonance. Only
    /// modes with frequencies from a tenth to twice the peak frequency are considered. Null if there is no such mode,
    /// if the peak is above the computed modes, after an interruption, and for scenes without modes.
    pub mode: Option<PeakMode>,
}

/// A mode, numbered in the order of `myovib modes`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PeakMode {
    /// One-based number of the mode.
    pub number: usize,
    /// Natural frequency (Hz).
    pub frequency: f64,
}

/// Position and size of a maximum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Maximum {
    pub(super) frequency: f64,
    pub(super) amplitude: f64,
    pub(super) damping_ratio: Option<f64>,
}

/// Returns whether an amplitude varies only by rounding errors, like the amplitude of a prescribed support motion.
pub(super) fn is_constant(amplitudes: impl Iterator<Item = f64> + Clone) -> bool {
    let largest = amplitudes.clone().fold(0.0, f64::max);
    let smallest = amplitudes.fold(f64::INFINITY, f64::min);
    smallest >= (1.0 - CONSTANT) * largest
}

/// Returns the frequency of the largest amplitude between `low` and `high`, by golden-section search.
pub(super) fn maximum(amplitude: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    // The interval shrinks to about the square root of the rounding error, which limits the accuracy of a maximum.
    while high - low > 1e-9 * high {
        let [a, b] = [high - golden * (high - low), low + golden * (high - low)];
        match amplitude(a) > amplitude(b) {
            true => high = b,
            false => low = a,
        }
    }
    0.5 * (low + high)
}

/// Returns the frequency nearest to `from` in the direction of `to` at which the amplitude is `level`, if there is one.
pub(super) fn falls_to(
    amplitude: impl Fn(f64) -> f64,
    level: f64,
    from: f64,
    to: f64,
) -> Option<f64> {
    let place = |i: usize| from + (to - from) * i as f64 / SEARCH as f64;
    let below = |f: f64| amplitude(f) <= level;
    let first = (1..=SEARCH).find(|&i| below(place(i)))?;
    let (mut inside, mut outside) = (place(first - 1), place(first));
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        match below(middle) {
            true => outside = middle,
            false => inside = middle,
        }
    }
    Some(0.5 * (inside + outside))
}

/// Returns the local maxima of a curve at ascending frequencies.
pub(super) fn maxima(frequencies: &[f64], values: &[Complex64]) -> Vec<Maximum> {
    let size = |k: usize| values[k].norm();
    let n = frequencies.len();
    let inner =
        (1..n.saturating_sub(1)).filter(|&k| size(k - 1) < size(k) && size(k) >= size(k + 1));
    inner.map(|k| resolved(frequencies, values, k)).collect()
}

/// Returns the maximum near sample `k`, or the sample itself if the samples do not resolve it.
fn resolved(frequencies: &[f64], values: &[Complex64], k: usize) -> Maximum {
    let n = frequencies.len();
    let unresolved =
        Maximum { frequency: frequencies[k], amplitude: values[k].norm(), damping_ratio: None };
    let [least, most] = SAMPLES;
    let count = most.min(n - (n + 1) % 2);
    if count < least {
        return unresolved;
    }
    let [(curve, frequency, amplitude, ends), (_, _, other, _)] = [count, count - 2].map(|count| {
        let first = k.saturating_sub(count / 2).min(n - count);
        let last = first + count - 1;
        let rows: Vec<_> = values[first..=last].iter().map(|z| vec![*z]).collect();
        let curve = Rational::through(&frequencies[first..=last], &rows);
        let curve = move |f: f64| curve.at(f, 1)[0];
        let amplitude_at = |f: f64| curve(f).norm();
        let frequency = maximum(amplitude_at, frequencies[k - 1], frequencies[k + 1]);
        let amplitude = amplitude_at(frequency);
        (curve, frequency, amplitude, [first, last].map(|i| frequencies[i]))
    });
    if amplitude.is_nan() || (amplitude - other).abs() > RESOLVED * amplitude {
        return unresolved;
    }
    let damping_ratio = damping_ratio(curve, frequency, ends.map(Some));
    Maximum { frequency, amplitude, damping_ratio }
}

/// Returns the damping ratio from the half-power width of the maximum at `frequency`. The half-power frequencies are
/// searched for up to the `ends`. Returns `None` if the width is not found or if the maximum is not a resonance. At a
/// resonance, the phase changes by 45° from each half-power frequency to the maximum; between two antiresonances, it
/// changes by 0° or 180°.
pub(super) fn damping_ratio(
    curve: impl Fn(f64) -> Complex64,
    frequency: f64,
    ends: [Option<f64>; 2],
) -> Option<f64> {
    let at_maximum = curve(frequency);
    let half = at_maximum.norm() / 2.0_f64.sqrt();
    let side = |end: Option<f64>| falls_to(|f| curve(f).norm(), half, frequency, end?);
    let (low, high) = side(ends[0]).zip(side(ends[1]))?;
    let turns = [curve(low) / at_maximum, at_maximum / curve(high)].map(|z| z.arg().to_degrees());
    let is_resonance = |sign: f64| turns.iter().all(|turn| RESONANCE.contains(&(sign * turn)));
    (is_resonance(1.0) || is_resonance(-1.0)).then(|| 0.5 * (high - low) / frequency)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the response of two oscillators. The first oscillator has a natural frequency of 10 Hz and the damping
    /// ratio ζ = 0.02, so its amplitude has a maximum at 10 √(1 − 2ζ²) Hz.
    #[test]
    fn peaks_lie_between_the_samples() {
        let mode = |f0: f64, f: f64| 1.0 / Complex64::new(f0 * f0 - f * f, 0.04 * f0 * f);
        let frequencies: Vec<f64> = (0..60).map(|i| 1.0 + 0.5 * f64::from(i)).collect();
        let curve = |f: f64| mode(10.0, f) + 0.3 * mode(23.0, f);
        let values: Vec<Complex64> = frequencies.iter().map(|f| curve(*f)).collect();
        let found = maxima(&frequencies, &values);
        assert_eq!(found.len(), 2);
        let (mut best, mut at) = (0.0, 0.0);
        for i in 0..200_000 {
            let f = 9.9 + 1e-6 * f64::from(i);
            if curve(f).norm() > best {
                (best, at) = (curve(f).norm(), f);
            }
        }
        // The search above has a tolerance of 1e-6 Hz.
        assert!((found[0].frequency - at).abs() < 2e-6, "{found:?} {at}");
        assert!((found[0].amplitude / best - 1.0).abs() < 1e-9, "{found:?}");
        // Between two antiresonances of real amplitudes, there is a maximum at which the phase does not change.
        let flank = |f: f64| Complex64::from((f - 5.0) * (9.0 - f));
        assert_eq!(damping_ratio(flank, 7.0, [Some(5.0), Some(9.0)]), None);
        // The half-power width determines ζ up to terms of order ζ².
        assert!((found[0].damping_ratio.unwrap() - 0.02).abs() < 1e-4, "{found:?}");
    }
}

//! The mean frequency of a recorded centroid, by counting its turns.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// The mean frequency in Hz of a centroid sampled at times `t`, positive in the oscillators'
/// natural (clockwise) sense; `None` unless Ψ ≠ 0 at two times.
///
/// `f = −(Θ_end − Θ_start)/(2π (t_end − t_start))` with Θ = arg Ψ continued from sample to sample.
/// Where Ψ passes by 0, Θ makes half a turn faster than any sampling, so that a mean of sampled
/// instantaneous frequencies misses it; the continued angle does not. It is continued in the frame
/// that turns with the motion, at the rate `arg Σ conj(Ψ_k) Ψ_{k+1}` per step, in which the
/// centroid moves slowly and on its short way: there the sense of a passage is the true one.
/// Samples at which Ψ = 0 have no angle and are passed over.
///
/// # Shapes
/// `t` (ascending, evenly spaced) and `centroid` have the same length.
///
/// # Units
/// s, Hz. Half a turn per sample is the fastest motion resolved.
///
/// # Panics
/// When the lengths differ.
///
/// # Examples
/// ```
/// use myovib_oscillators::mean_frequency;
/// use num_complex::Complex64;
/// let t: Vec<f64> = (0..=100).map(|k| 0.01 * f64::from(k)).collect();
/// let clockwise = |t: &f64| Complex64::cis(-std::f64::consts::TAU * 8.0 * t);
/// let centroid: Vec<_> = t.iter().map(clockwise).collect();
/// assert!((mean_frequency(&t, &centroid).unwrap() - 8.0).abs() < 1e-12);
/// ```
pub fn mean_frequency(t: &[f64], centroid: &[Complex64]) -> Option<f64> {
    assert_eq!(t.len(), centroid.len(), "one centroid per time");
    let moving: Vec<(f64, Complex64)> = t
        .iter()
        .copied()
        .zip(centroid.iter().copied())
        .filter(|(_, psi)| psi.norm_sqr() > 0.0)
        .collect();
    let [(start, _), .., (end, _)] = moving[..] else {
        return None;
    };
    let step = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
    let advance: Complex64 = centroid.windows(2).map(|z| z[0].conj() * z[1]).sum();
    let rate = advance.arg() / step;
    let in_frame = moving.windows(2).map(|pair| {
        let [(from, before), (to, after)] = [pair[0], pair[1]];
        (before.conj() * after * Complex64::cis(-rate * (to - from))).arg()
    });
    Some(-(rate + in_frame.sum::<f64>() / (end - start)) / TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drive of 8 Hz and a free motion of 7.75 Hz with `ratio` of its strength, from 3 s to 23 s.
    fn beats(ratio: f64) -> (Vec<f64>, Vec<Complex64>) {
        let t: Vec<f64> = (300..=2300).map(|k| 0.01 * f64::from(k)).collect();
        let turning = |frequency: f64, t: f64| Complex64::cis(-TAU * frequency * t);
        // The phase puts the passages by 0 in the middle between samples, where the angle jumps by
        // nearly half a turn: with the motion's own 0.08 turns by more, if it is not in its frame.
        let phase = 0.25 * 0.005 / 7.75;
        let centroid = t
            .iter()
            .map(|&t| turning(8.0, t) + ratio * turning(7.75, t + phase));
        let centroid = centroid.collect();
        (t, centroid)
    }

    /// The stronger part has the centroid, however close it comes to 0 between samples: five
    /// beats end with the angle they began with, in its frame, but for rounding.
    #[test]
    fn a_passage_by_zero_between_samples_keeps_its_half_turn() {
        for (ratio, expected) in [(0.9999, 8.0), (1.0001, 7.75), (0.5, 8.0)] {
            let (t, centroid) = beats(ratio);
            let found = mean_frequency(&t, &centroid).unwrap();
            assert!((found - expected).abs() < 1e-12, "{ratio}: {found}");
        }
    }

    #[test]
    fn a_sample_at_zero_is_passed_over() {
        let (t, mut centroid) = beats(0.5);
        centroid[0] = Complex64::ZERO;
        centroid[700] = Complex64::ZERO;
        // The beat now begins a sample later: 0.01 s of an angle that sways by asin 0.5.
        let found = mean_frequency(&t, &centroid).unwrap();
        assert!(
            (found - 8.0).abs() < 0.5_f64.asin() / TAU / 19.99,
            "{found}"
        );
    }

    #[test]
    fn rest_has_no_frequency() {
        assert_eq!(mean_frequency(&[0.0, 1.0], &[Complex64::ZERO; 2]), None);
        assert_eq!(mean_frequency(&[], &[]), None);
        assert_eq!(mean_frequency(&[0.0], &[Complex64::ONE]), None);
    }
}

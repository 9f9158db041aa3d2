//! Mean frequency of a recorded centroid, computed from its accumulated rotation angle.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// Returns the mean frequency (Hz) of a centroid sampled at the times `t`, or `None` unless Ψ ≠ 0 at two or more
/// times. The frequency is positive for the natural (clockwise) sense of rotation.
///
/// `f = −(Θ_end − Θ_start)/(2π (t_end − t_start))` with Θ = arg Ψ unwrapped from sample to sample. If Ψ passes
/// near 0, Θ changes by half a revolution within a very short time. A mean of sampled instantaneous frequencies
/// misses this change, but the unwrapped angle includes it. The angle is unwrapped in a frame that rotates with
/// the motion, at the rate `arg Σ conj(Ψ_k) Ψ_{k+1}` per step. In this frame, the centroid moves slowly, so the
/// sense of rotation is detected correctly when Ψ passes near 0. Samples with Ψ = 0 have no angle and are skipped.
///
/// # Shapes
/// `t` (ascending, evenly spaced) and `centroid` have the same length.
///
/// # Units
/// Times are in s, the result is in Hz. The fastest resolved motion is half a revolution per sample.
///
/// # Panics
/// Panics if the lengths differ.
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

    /// Returns the sum of a forced motion of 8 Hz and a free motion of 7.75 Hz, sampled from 3 s to 23 s. The
    /// amplitude of the free motion is `ratio` times the amplitude of the forced motion.
    fn beats(ratio: f64) -> (Vec<f64>, Vec<Complex64>) {
        let t: Vec<f64> = (300..=2300).map(|k| 0.01 * f64::from(k)).collect();
        let turning = |frequency: f64, t: f64| Complex64::cis(-TAU * frequency * t);
        // The phase places the passages near 0 midway between samples. There, the angle jumps by nearly half a
        // revolution, or by 0.08 revolutions more outside the rotating frame.
        let phase = 0.25 * 0.005 / 7.75;
        let centroid = t.iter().map(|&t| turning(8.0, t) + ratio * turning(7.75, t + phase));
        let centroid = centroid.collect();
        (t, centroid)
    }

    /// Checks that the stronger component determines the frequency, no matter how close the centroid comes to 0 between
    /// samples. In the frame that rotates with this component, five beats end at the initial angle, apart from rounding
    /// errors.
    #[test]
    fn a_passage_near_zero_between_samples_counts_half_a_revolution() {
        for (ratio, expected) in [(0.9999, 8.0), (1.0001, 7.75), (0.5, 8.0)] {
            let (t, centroid) = beats(ratio);
            let found = mean_frequency(&t, &centroid).unwrap();
            assert!((found - expected).abs() < 1e-12, "{ratio}: {found}");
        }
    }

    #[test]
    fn a_zero_sample_is_skipped() {
        let (t, mut centroid) = beats(0.5);
        centroid[0] = Complex64::ZERO;
        centroid[700] = Complex64::ZERO;
        // The beat now begins one sample later. This changes the result by 0.01 s of an angle that oscillates with
        // the amplitude asin 0.5.
        let found = mean_frequency(&t, &centroid).unwrap();
        assert!((found - 8.0).abs() < 0.5_f64.asin() / TAU / 19.99, "{found}");
    }

    #[test]
    fn rest_has_no_frequency() {
        assert_eq!(mean_frequency(&[0.0, 1.0], &[Complex64::ZERO; 2]), None);
        assert_eq!(mean_frequency(&[], &[]), None);
        assert_eq!(mean_frequency(&[0.0], &[Complex64::ONE]), None);
    }
}

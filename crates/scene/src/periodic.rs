//! Periodic states of scenes.

use std::f64::consts::TAU;

use num_complex::Complex64;
use serde::Serialize;

use crate::response::phase;

/// Maximum number of harmonics computed for each probe.
const MOST_HARMONICS: usize = 10;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Periodic {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Period (s).
    pub period: f64,
    /// Time (s) at which the period starts.
    pub start_time: f64,
    pub differential_variables: usize,
    /// Maximum difference between the states at the start and the end of the period, relative to the size of the
    /// motion.
    pub residual: f64,
    pub newton_iterations: usize,
    /// Number of integrations over a period.
    pub integrations: u64,
    /// Total number of steps in all integrations.
    pub steps: u64,
    /// Largest magnitude of the Floquet multipliers, if any were computed.
    pub spectral_radius: Option<f64>,
    /// Whether all multipliers are inside the unit circle; `None` without multipliers, or if the largest multiplier is on
    /// the circle, as in systems without damping.
    pub is_stable: Option<bool>,
    /// Leading Floquet multipliers as [real part, imaginary part], in descending order of magnitude.
    pub multipliers: Vec<[f64; 2]>,
    pub probes: Vec<Harmonics>,
    /// Curve of periodic states along which a parameter varies, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub continuation: Option<Curve>,
}

/// Curve of periodic states along which a parameter varies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// Key of the parameter in the scene.
    pub parameter: String,
    /// Names of the probe values, in the form `PROBE.COLUMN`.
    pub columns: Vec<String>,
    pub points: Vec<CurvePoint>,
    /// Reason why the curve ended inside its range; null if the curve left the range.
    pub incomplete: Option<String>,
}

/// Periodic state on a curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurvePoint {
    pub parameter: f64,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Whether the curve has a fold at this state, where the parameter changes direction.
    pub is_fold: bool,
    /// Largest magnitude of the Floquet multipliers.
    pub spectral_radius: f64,
    /// Whether the state is stable; null on the stability boundary, for example at a fold.
    pub is_stable: Option<bool>,
    /// Amplitude of the first harmonic of each probe value.
    pub amplitudes: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Harmonics {
    pub name: String,
    pub columns: Vec<Column>,
}

/// Mean, range and harmonics of a probe value: mean + Σ a_k cos(2π k f t + φ_k).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    pub name: String,
    pub mean: f64,
    pub minimum: f64,
    pub maximum: f64,
    pub amplitudes: Vec<f64>,
    /// Phases φ_1, φ_2, … in degrees.
    pub phases: Vec<f64>,
}

impl Column {
    /// Analyzes equidistant samples of one period. The start of the period is at the time `start`, in units of the
    /// period. The end of the period is not a sample.
    pub(crate) fn new(name: String, samples: &[f64], start: f64) -> Self {
        let n = samples.len() as f64;
        let coefficient = |k: usize| -> Complex64 {
            let terms = samples.iter().enumerate().map(|(i, value)| {
                let angle = -TAU * k as f64 * (start + i as f64 / n);
                Complex64::from_polar(2.0 * value / n, angle)
            });
            terms.sum()
        };
        let most = MOST_HARMONICS.min((samples.len() - 1) / 2);
        let harmonics: Vec<Complex64> = (1..=most).map(coefficient).collect();
        let fold = |of: fn(f64, f64) -> f64| samples.iter().copied().reduce(of).unwrap_or(f64::NAN);
        Self {
            name,
            mean: samples.iter().sum::<f64>() / n,
            minimum: fold(f64::min),
            maximum: fold(f64::max),
            amplitudes: harmonics.iter().map(|z| z.norm()).collect(),
            phases: harmonics.iter().map(|z| phase(*z)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_are_those_of_the_samples() {
        let start = 0.3;
        let value = |i: usize| {
            let s = TAU * (start + i as f64 / 32.0);
            2.0 + 3.0 * (s + 0.5).cos() + 0.1 * (3.0 * s - 1.0).cos()
        };
        let samples: Vec<f64> = (0..32).map(value).collect();
        let found = Column::new("u".to_owned(), &samples, start);
        let expected = [3.0, 0.0, 0.1];
        // The tolerance covers rounding errors of 32 terms of magnitude 0.2.
        assert!((found.mean - 2.0).abs() < 1e-14);
        for (amplitude, expected) in found.amplitudes.iter().zip(expected) {
            assert!((amplitude - expected).abs() < 1e-14);
        }
        assert!((found.phases[0] - 0.5_f64.to_degrees()).abs() < 1e-12);
        assert!((found.phases[2] + 1.0_f64.to_degrees()).abs() < 1e-10);
    }
}

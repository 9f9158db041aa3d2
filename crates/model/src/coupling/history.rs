//! Coherence of oscillators over time.

use myovib_dae::{Problem, StepError};
use myovib_oscillators::{Coherence, Settled, centroid_frequency, mean_frequency, phasors};
use num_complex::Complex64;
use serde::Serialize;

use super::dae::CoupledDae;
use crate::error::ModelError;

/// Ψ, χ, the phasors of the oscillators and the frequency of the centroid at sample times.
#[derive(Debug, Clone, Default)]
pub struct CoherenceHistory {
    /// Times, s.
    pub t: Vec<f64>,
    /// Ψ of eq. (23).
    pub centroid: Vec<Complex64>,
    /// χ of eq. (23).
    pub phase: Vec<Complex64>,
    /// r_n e^{iθ_n}, one per oscillator.
    pub phasors: Vec<Vec<Complex64>>,
    /// Instantaneous frequency of the centroid, Hz; NaN while Ψ = 0.
    pub frequency: Vec<f64>,
}

/// Mean, range and standard deviation over a trailing window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settling {
    /// Length of the window, s.
    pub window: f64,
    /// |Ψ|.
    #[serde(rename = "psi")]
    pub centroid: Settled,
    /// |χ|.
    #[serde(rename = "chi")]
    pub phase: Settled,
    /// Frequency of the centroid, Hz. The mean is the number of turns divided by the time, or NaN if the centroid is at
    /// rest. The range and the deviation from this mean refer to the instantaneous frequency where it is defined.
    pub frequency: Settled,
}

impl CoherenceHistory {
    /// Appends the state of network `k` of `dae` at time `t`.
    ///
    /// The frequency uses ÿ from the equations, not finite differences of samples.
    pub fn record<B: Problem>(
        &mut self,
        dae: &mut CoupledDae<B>,
        k: usize,
        t: f64,
        y: &[f64],
    ) -> Result<(), StepError> {
        let acceleration = dae.accelerations(k, t, y)?;
        let network = dae.oscillators(k).network();
        let omega = network.omega();
        let (position, velocity) = y[dae.range(k)].split_at(network.n_oscillators());
        let Coherence { centroid, phase } = Coherence::new(omega, position, velocity);
        self.t.push(t);
        self.centroid.push(centroid);
        self.phase.push(phase);
        self.phasors.push(phasors(omega, position, velocity).collect());
        let frequency = centroid_frequency(omega, position, velocity, &acceleration);
        self.frequency.push(frequency.unwrap_or(f64::NAN));
        Ok(())
    }

    /// Returns |Ψ| at the sample times.
    pub fn strength(&self) -> Vec<f64> {
        self.centroid.iter().map(|z| z.norm()).collect()
    }

    /// Returns |χ| at the sample times.
    pub fn coherence(&self) -> Vec<f64> {
        self.phase.iter().map(|z| z.norm()).collect()
    }

    /// Returns the mean, range and standard deviation of |Ψ|, |χ| and the frequency of the centroid over the last
    /// `window` seconds.
    ///
    /// # Errors
    /// Returns [`ModelError::Oscillators`] if the window contains fewer than two samples.
    pub fn settled(&self, window: f64) -> Result<Settling, ModelError> {
        let over = |values: &[f64]| Settled::over_window(&self.t, values, window);
        Ok(Settling {
            window,
            centroid: over(&self.strength())?,
            phase: over(&self.coherence())?,
            frequency: self.settled_frequency(window),
        })
    }

    fn settled_frequency(&self, window: f64) -> Settled {
        let samples = self.t.iter().zip(&self.frequency);
        let defined = samples.filter(|(_, frequency)| !frequency.is_nan());
        let (t, frequency): (Vec<f64>, Vec<f64>) = defined.unzip();
        let sampled = Settled::over_window(&t, &frequency, window).unwrap_or(Settled {
            mean: f64::NAN,
            min: f64::NAN,
            max: f64::NAN,
            std: f64::NAN,
            samples: t.len(),
        });
        let start = self.t.last().map_or(0.0, |end| end - window);
        let first = self.t.partition_point(|&time| time < start);
        let mean = mean_frequency(&self.t[first..], &self.centroid[first..]).unwrap_or(f64::NAN);
        Settled {
            mean,
            // Deviation about this mean instead of the mean of the samples.
            std: sampled.std.hypot(sampled.mean - mean),
            ..sampled
        }
    }
}

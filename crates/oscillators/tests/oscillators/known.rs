//! Oscillators with known solutions.

use std::f64::consts::TAU;

use num_complex::Complex64;

use myovib_oscillators::{Chain, Coefficients, Ends, Reach};

/// Returns Van der Pol's oscillator `ÿ − μ (1 − y²) ẏ + ω² y = 0` as a chain of one oscillator.
///
/// Its limit cycle has the amplitude A(μ/ω) and the period T(μ/ω)/ω, where A and T are the amplitude and the
/// period for ω = 1 as functions of μ.
pub(crate) fn van_der_pol(vdp_mu: f64, omega: f64) -> Chain {
    Chain {
        omega: vec![omega],
        coefficients: Coefficients { vdp_mu, duffing: 0.0, coupling: 0.0 },
        ends: Ends::Open,
        reach: Reach::All,
    }
}

/// A traveling wave of small amplitude on a free periodic chain of identical oscillators.
///
/// For y² ≪ 1, the chain is linear, and its solution is `y_n(t) = Re(a exp(λ t + 2πi k n/N))`, n = 0 … N−1, where
/// `λ² − μ λ + Ω² = 0`, `Ω² = ω² − D ω cos(2πk/N)`. Every wave grows like e^{μt/2}.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChainMode {
    /// Number of oscillators N.
    pub(crate) n_oscillators: usize,
    /// Wave number k.
    pub(crate) wave_number: usize,
    /// Natural frequency ω of all oscillators in rad/s.
    pub(crate) omega: f64,
    /// Coefficients μ and D. The Duffing term is negligible at small amplitudes.
    pub(crate) coefficients: Coefficients,
    /// Amplitude a at t = 0.
    pub(crate) amplitude: f64,
}

impl ChainMode {
    /// Returns the chain that carries the wave.
    pub(crate) fn chain(&self) -> Chain {
        Chain {
            omega: vec![self.omega; self.n_oscillators],
            coefficients: self.coefficients,
            ends: Ends::Periodic,
            reach: Reach::All,
        }
    }

    /// Returns Ω² of the wave, in rad²/s².
    pub(crate) fn squared_frequency(&self) -> f64 {
        self.omega.powi(2) - self.coefficients.coupling * self.omega * self.phase_step().cos()
    }

    /// Returns λ = μ/2 + i sqrt(Ω² − μ²/4), in 1/s.
    pub(crate) fn exponent(&self) -> Complex64 {
        let half_mu = self.coefficients.vdp_mu / 2.0;
        half_mu + Complex64::from(half_mu.powi(2) - self.squared_frequency()).sqrt()
    }

    /// Returns the states (y, w) of the chain at time t.
    pub(crate) fn states(&self, t: f64) -> Vec<f64> {
        let lambda = self.exponent();
        let wave = |n: usize| {
            self.amplitude * (lambda * t + Complex64::I * (self.phase_step() * n as f64)).exp()
        };
        let positions = (0..self.n_oscillators).map(|n| wave(n).re);
        let velocities = (0..self.n_oscillators).map(|n| (lambda * wave(n)).re);
        positions.chain(velocities).collect()
    }

    fn phase_step(&self) -> f64 {
        TAU * self.wave_number as f64 / self.n_oscillators as f64
    }
}

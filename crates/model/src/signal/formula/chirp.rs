//! A sine whose frequency rises or falls.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Constants, Role};
use crate::signal::timing::{Break, first, shortest};
use crate::signal::{Jet, Objection, TimeFunction};

/// Linear frequency sweep; from t = `duration` on, the frequency stays at `end_frequency`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Chirp {
    /// Amplitude.
    pub amplitude: f64,
    /// Frequency at t = 0, Hz.
    #[schemars(extend("minimum" = 0))]
    pub frequency: f64,
    /// Frequency at t = `duration`, Hz.
    #[schemars(extend("minimum" = 0))]
    pub end_frequency: f64,
    /// Duration of the sweep, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub duration: f64,
    /// Phase, rad.
    #[serde(default)]
    pub phase: f64,
}

impl Chirp {
    /// Returns the frequency (Hz) at time `t`.
    fn frequency_at(&self, t: f64) -> f64 {
        let passed = (t / self.duration).min(1.0);
        self.frequency + passed * (self.end_frequency - self.frequency)
    }
}

impl Constants for Chirp {
    const ROLES: &[(&str, Role)] = &[
        ("amplitude", Role::Factor),
        ("frequency", Role::Smooth),
        ("end_frequency", Role::Smooth),
        ("phase", Role::Smooth),
    ];
}

impl TimeFunction for Chirp {
    fn at(&self, t: f64) -> Jet {
        let time = Jet::variable(t);
        let cycles = if t <= self.duration {
            let rate = (self.end_frequency - self.frequency) / self.duration;
            (time * (0.5 * rate) + self.frequency) * time
        } else {
            let mean = 0.5 * (self.frequency + self.end_frequency);
            (time + (-self.duration)) * self.end_frequency + mean * self.duration
        };
        (cycles * TAU + self.phase).sin() * self.amplitude
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let ends = [from, to].map(|t| self.frequency_at(t).abs());
        shortest([ends[0].max(ends[1]).recip()])
    }

    /// Does not limit steps, because the error test resolves a continuing vibration.
    fn longest_step(&self, _: f64, _: f64) -> Option<f64> {
        None
    }

    fn constant_over(&self, _: f64, _: f64) -> Option<f64> {
        (self.amplitude == 0.0).then_some(0.0)
    }

    fn frequency(&self) -> Option<f64> {
        let highest = self.frequency.abs().max(self.end_frequency.abs());
        (highest != 0.0).then_some(highest)
    }

    fn sweep(&self, to: f64) -> Option<[f64; 2]> {
        let [a, b] = [0.0, to].map(|t| self.frequency_at(t));
        let lowest = if a * b < 0.0 { 0.0 } else { a.abs().min(b.abs()) };
        Some([lowest, a.abs().max(b.abs())])
    }

    fn next_break(&self, after: f64) -> Option<Break> {
        first([self.duration; 2], after, self.lowest_jump())
    }

    fn lowest_jump(&self) -> u8 {
        2
    }

    fn objection(&self) -> Option<Objection> {
        (self.duration <= 0.0).then(|| Objection {
            key: "duration",
            problem: "the sweep has no duration",
            found: format!("duration = {}", self.duration),
            allowed: "a positive time in s",
            next: "for a single frequency, use { type = \"sine\", amplitude = ..., frequency = ... }",
        })
    }
}

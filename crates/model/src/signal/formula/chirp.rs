//! A sine whose frequency rises or falls.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::signal::timing::shortest;
use crate::signal::{Jet, Objection, TimeFunction};

/// A sweep of frequencies, `amplitude · sin(2π (f t + (end_frequency − f) t²/(2 duration)) + phase)` with
/// `frequency` f at t = 0, `end_frequency` at t = `duration`, and changing in the same way after that.
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
    /// Time from one to the other, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub duration: f64,
    /// Phase, rad.
    #[serde(default)]
    pub phase: f64,
}

impl Chirp {
    /// Change of the frequency in a second, Hz/s.
    fn rate(&self) -> f64 {
        (self.end_frequency - self.frequency) / self.duration
    }

    /// The highest frequency between two times, Hz.
    fn highest(&self, start: f64, end: f64) -> f64 {
        let at = |t: f64| (self.frequency + self.rate() * t).abs();
        at(start).max(at(end))
    }
}

impl TimeFunction for Chirp {
    fn at(&self, t: f64) -> Jet {
        let t = Jet::variable(t);
        let cycles = (t * (0.5 * self.rate()) + self.frequency) * t;
        (cycles * TAU + self.phase).sin() * self.amplitude
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        shortest([self.highest(from, to).recip()])
    }

    /// Error estimates see what goes on.
    fn longest_step(&self, _: f64, _: f64) -> Option<f64> {
        None
    }

    fn constant_over(&self, _: f64, _: f64) -> Option<f64> {
        (self.amplitude == 0.0).then_some(0.0)
    }

    fn frequency(&self) -> Option<f64> {
        let highest = self.highest(0.0, self.duration);
        (highest != 0.0).then_some(highest)
    }

    fn objection(&self) -> Option<Objection> {
        (self.duration <= 0.0).then(|| Objection {
            key: "duration",
            problem: "the sweep takes no time",
            found: format!("duration = {}", self.duration),
            allowed: "a positive time, s",
            next: "of one frequency it is { type = \"sine\", amplitude = ..., frequency = ... }",
        })
    }
}

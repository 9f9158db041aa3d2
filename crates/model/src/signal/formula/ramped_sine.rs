//! A sine ramped up by a sigmoid.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Constants, Role};
use crate::paper::{LOAD_FREQUENCY, LOAD_SHIFT, LOAD_STEEPNESS};
use crate::signal::timing::shortest;
use crate::signal::{Jet, TimeFunction};

/// Distance from the center of a sigmoid, in units of 1/steepness, beyond which it is constant to within 2e-9 of its
/// height.
const SIGMOID_WIDTH: f64 = 20.0;

/// The paper's load: `amplitude · (1/(1+exp(-steepness t + shift)) - 1/(1+exp(shift))) · sin(2π frequency t)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct RampedSine {
    /// Amplitude after the ramp.
    pub amplitude: f64,
    /// Frequency, Hz.
    #[serde(default = "paper_frequency")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub frequency: f64,
    /// Steepness of the sigmoid, 1/s.
    #[serde(default = "paper_steepness")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub steepness: f64,
    /// Shift; the center of the sigmoid is at t = `shift / steepness`.
    #[serde(default = "paper_shift")]
    pub shift: f64,
}

fn paper_frequency() -> f64 {
    LOAD_FREQUENCY
}

fn paper_steepness() -> f64 {
    LOAD_STEEPNESS
}

fn paper_shift() -> f64 {
    LOAD_SHIFT
}

impl RampedSine {
    /// Returns the rise time of the sigmoid (s) if it rises between two times. The largest slope of the sigmoid is a
    /// quarter of its steepness.
    fn rise(&self, from: f64, to: f64) -> Option<f64> {
        let [first, last] = [from, to].map(|t| self.steepness * t - self.shift);
        let rises = first.min(last) < SIGMOID_WIDTH && first.max(last) > -SIGMOID_WIDTH;
        shortest(rises.then(|| 4.0 / self.steepness.abs()))
    }
}

impl Constants for RampedSine {
    const ROLES: &[(&str, Role)] = &[
        ("amplitude", Role::Factor),
        ("frequency", Role::Smooth),
        ("steepness", Role::Smooth),
        ("shift", Role::Smooth),
    ];
}

impl TimeFunction for RampedSine {
    fn at(&self, t: f64) -> Jet {
        let time = Jet::variable(t);
        let at_rest = 1.0 / (1.0 + self.shift.exp());
        let ramp = (time * self.steepness + (-self.shift)).sigmoid() + (-at_rest);
        ramp * (time * (TAU * self.frequency)).sin() * self.amplitude
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let rise = self.rise(from, to).into_iter();
        shortest(rise.chain([self.frequency.abs().recip()]))
    }

    /// Limits steps only while the sigmoid rises. The rise is smooth and gradual, so error estimates detect it even
    /// with steps as long as the rise time.
    fn longest_step(&self, from: f64, to: f64) -> Option<f64> {
        self.rise(from, to)
    }

    fn constant_over(&self, _: f64, _: f64) -> Option<f64> {
        (self.amplitude == 0.0).then_some(0.0)
    }

    fn frequency(&self) -> Option<f64> {
        (self.frequency != 0.0).then_some(self.frequency.abs())
    }
}

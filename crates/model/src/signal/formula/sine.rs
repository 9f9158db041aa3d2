//! A sine.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Constants, Role};
use crate::signal::timing::shortest;
use crate::signal::{Jet, TimeFunction};

/// `amplitude · sin(2π frequency t + phase)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Sine {
    /// Amplitude.
    pub amplitude: f64,
    /// Frequency, Hz.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub frequency: f64,
    /// Phase, rad.
    #[serde(default)]
    pub phase: f64,
}

impl Constants for Sine {
    const ROLES: &[(&str, Role)] =
        &[("amplitude", Role::Factor), ("frequency", Role::Smooth), ("phase", Role::Smooth)];
}

impl TimeFunction for Sine {
    fn at(&self, t: f64) -> Jet {
        (Jet::variable(t) * (TAU * self.frequency) + self.phase).sin() * self.amplitude
    }

    fn time_scale(&self, _: f64, _: f64) -> Option<f64> {
        shortest([self.frequency.abs().recip()])
    }

    /// Does not limit steps, because the error test resolves a continuing vibration.
    fn longest_step(&self, _: f64, _: f64) -> Option<f64> {
        None
    }

    fn constant_over(&self, _: f64, _: f64) -> Option<f64> {
        (self.amplitude == 0.0).then_some(0.0)
    }

    fn frequency(&self) -> Option<f64> {
        (self.frequency != 0.0).then_some(self.frequency.abs())
    }
}

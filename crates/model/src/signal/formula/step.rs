//! A step, smooth or sudden.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Constants, Role};
use crate::signal::timing::{Break, between, first, just_after, shortest};
use crate::signal::{Jet, TimeFunction};

/// Smooth step from 0 at `start` to `value`; `rise = 0` is a jump, for displacements only in static analyses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct StepFunction {
    /// Value after the step.
    pub value: f64,
    /// Start time, s.
    #[serde(default)]
    pub start: f64,
    /// Rise time, s; 0 for a jump.
    #[schemars(extend("minimum" = 0))]
    pub rise: f64,
}

impl Constants for StepFunction {
    const ROLES: &[(&str, Role)] =
        &[("value", Role::Factor), ("start", Role::Break), ("rise", Role::Break)];
}

impl TimeFunction for StepFunction {
    fn at(&self, t: f64) -> Jet {
        let &Self { value, start, rise } = self;
        if rise == 0.0 {
            return Jet::constant(if t < just_after(start) { 0.0 } else { value });
        }
        let s = (Jet::variable(t) + (-start)) * (1.0 / rise);
        smooth_step(s) * value
    }

    fn time_scale(&self, _: f64, _: f64) -> Option<f64> {
        shortest([self.rise])
    }

    fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        between([self.start, self.start + self.rise], self.value, from, to)
    }

    fn next_break(&self, after: f64) -> Option<Break> {
        first([self.start, self.start + self.rise], after, self.lowest_jump())
    }

    fn lowest_jump(&self) -> u8 {
        if self.rise == 0.0 { 0 } else { 3 }
    }
}

/// Returns s³ (6 s² - 15 s + 10) for s between 0 and 1. The function is constant outside this interval.
fn smooth_step(s: Jet) -> Jet {
    let x = s.value.clamp(0.0, 1.0);
    s.compose(
        x * x * x * (x * (6.0 * x - 15.0) + 10.0),
        30.0 * x * x * (x - 1.0) * (x - 1.0),
        60.0 * x * (x - 1.0) * (2.0 * x - 1.0),
    )
}

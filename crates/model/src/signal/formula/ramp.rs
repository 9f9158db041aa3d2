//! A linear rise.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Constants, Role};
use crate::signal::timing::{Break, between, first, just_after, shortest};
use crate::signal::{Jet, Objection, TimeFunction};

/// Linear from 0 at `start` to `value` at `end`; for displacements only in static and quasi-static analyses, because its slope jumps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Ramp {
    /// Value at and after `end`.
    pub value: f64,
    /// Start time, s.
    #[serde(default)]
    pub start: f64,
    /// End time, s.
    pub end: f64,
}

impl Constants for Ramp {
    const ROLES: &[(&str, Role)] =
        &[("value", Role::Factor), ("start", Role::Break), ("end", Role::Break)];
}

impl TimeFunction for Ramp {
    fn at(&self, t: f64) -> Jet {
        let s = (Jet::variable(t) + (-self.start)) * (1.0 / (self.end - self.start));
        let inside = (just_after(self.start)..just_after(self.end)).contains(&t);
        s.compose(s.value.clamp(0.0, 1.0), f64::from(u8::from(inside)), 0.0) * self.value
    }

    fn time_scale(&self, _: f64, _: f64) -> Option<f64> {
        shortest([self.end - self.start])
    }

    fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        between([self.start, self.end], self.value, from, to)
    }

    fn next_break(&self, after: f64) -> Option<Break> {
        first([self.start, self.end], after, self.lowest_jump())
    }

    fn lowest_jump(&self) -> u8 {
        1
    }

    fn objection(&self) -> Option<Objection> {
        let Self { start, end, .. } = self;
        (end <= start).then(|| Objection {
            key: "end",
            problem: "the ramp ends before it starts",
            found: format!("start = {start}, end = {end}"),
            allowed: "an end after the start, in s",
            next: "for a jump, use a step: { type = \"step\", value = ..., start = ..., rise = 0 }",
        })
    }
}

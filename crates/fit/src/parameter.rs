//! Parameters.

use crate::error::FitError;

/// Parameter of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name in messages and reports.
    pub name: String,
    /// Initial value.
    pub start: f64,
    /// Typical size of the parameter, which is the unit of steps and of difference quotients. Default: |start|, or 1 if
    /// the start is 0.
    pub scale: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Whether steps change the logarithm of the value. The value then remains positive, and a start that is wrong by
    /// orders of magnitude requires only a few additional steps. Steps are relative to the value instead of `scale`.
    pub logarithmic: bool,
}

impl Parameter {
    /// Returns a parameter without bounds.
    pub fn new(name: impl Into<String>, start: f64) -> Self {
        Self {
            name: name.into(),
            start,
            scale: if start == 0.0 { 1.0 } else { start.abs() },
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
            logarithmic: false,
        }
    }

    /// Returns the same parameter, restricted to positive values.
    #[must_use]
    pub fn positive(self) -> Self {
        Self { low: self.low.max(0.0), logarithmic: true, ..self }
    }

    /// Returns the same parameter with bounds.
    #[must_use]
    pub fn within(self, low: f64, high: f64) -> Self {
        Self { low, high, ..self }
    }

    /// Returns the same parameter with a different start.
    #[must_use]
    pub fn starting_from(&self, start: f64) -> Self {
        Self { start, ..self.clone() }
    }

    pub(crate) fn check(&self) -> Result<(), FitError> {
        let refused =
            |what, value| Err(FitError::Parameter { name: self.name.clone(), what, value });
        if !self.start.is_finite() {
            return refused("the start must be finite", self.start);
        }
        if !(self.scale > 0.0 && self.scale.is_finite()) {
            return refused("the scale must be positive and finite", self.scale);
        }
        if self.low.is_nan() || self.high.is_nan() || self.low >= self.high {
            return refused("the lower bound must be below the upper bound", self.low);
        }
        if self.start < self.low || self.start > self.high {
            return refused("the start must be within the bounds", self.start);
        }
        if self.logarithmic && self.start <= 0.0 {
            return refused("the start must be positive", self.start);
        }
        Ok(())
    }

    /// Returns, to first order, the change of the value caused by a scaled step of 1 from `p`.
    pub(crate) fn unit(&self, p: f64) -> f64 {
        if self.logarithmic { p } else { self.scale }
    }

    /// Returns the value after the scaled step `x` from `p`, clamped to the bounds.
    pub(crate) fn step(&self, p: f64, x: f64) -> f64 {
        let next = if self.logarithmic { p * x.exp() } else { p + x * self.scale };
        next.clamp(self.low, self.high)
    }

    /// Returns the length of the step from `p` to `next` in scaled units.
    pub(crate) fn distance(&self, p: f64, next: f64) -> f64 {
        if self.logarithmic { (next / p).ln() } else { (next - p) / self.scale }
    }
}

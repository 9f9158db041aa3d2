//! What is fitted.

use crate::error::FitError;

/// A parameter to be fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name in messages and reports.
    pub name: String,
    /// Where the fit starts.
    pub start: f64,
    /// Its typical size, by which steps and differences are measured. |start| unless told, 1 for 0.
    pub scale: f64,
    /// The least value allowed.
    pub low: f64,
    /// The largest value allowed.
    pub high: f64,
    /// Whether steps change the logarithm: the value then stays positive, and a start that is wrong by orders of
    /// magnitude is left in few steps. Steps are relative to the value, not to `scale`.
    pub logarithmic: bool,
}

impl Parameter {
    /// A parameter without bounds.
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
        Self {
            low: self.low.max(0.0),
            logarithmic: true,
            ..self
        }
    }

    /// The same with bounds.
    #[must_use]
    pub fn within(self, low: f64, high: f64) -> Self {
        Self { low, high, ..self }
    }

    /// The same from another start.
    #[must_use]
    pub fn starting_from(&self, start: f64) -> Self {
        Self {
            start,
            ..self.clone()
        }
    }

    pub(crate) fn check(&self) -> Result<(), FitError> {
        let refused = |what, value| {
            Err(FitError::Parameter {
                name: self.name.clone(),
                what,
                value,
            })
        };
        if !self.start.is_finite() {
            return refused("a start that is not finite", self.start);
        }
        if !(self.scale > 0.0 && self.scale.is_finite()) {
            return refused("a scale that is not positive and finite", self.scale);
        }
        if self.low.is_nan() || self.high.is_nan() || self.low >= self.high {
            return refused("a lower bound that is not below the upper one", self.low);
        }
        if self.start < self.low || self.start > self.high {
            return refused("a start outside of its bounds", self.start);
        }
        if self.logarithmic && self.start <= 0.0 {
            return refused("a start that is not positive", self.start);
        }
        Ok(())
    }

    /// Returns the change of the value `p` that a scaled step of 1 stands for, to first order.
    pub(crate) fn unit(&self, p: f64) -> f64 {
        if self.logarithmic { p } else { self.scale }
    }

    /// Returns the value after the scaled step `x` from `p`, within the bounds.
    pub(crate) fn step(&self, p: f64, x: f64) -> f64 {
        let next = if self.logarithmic {
            p * x.exp()
        } else {
            p + x * self.scale
        };
        next.clamp(self.low, self.high)
    }

    /// Returns the scaled length of the step from `p` to `next`.
    pub(crate) fn distance(&self, p: f64, next: f64) -> f64 {
        if self.logarithmic {
            (next / p).ln()
        } else {
            (next - p) / self.scale
        }
    }
}

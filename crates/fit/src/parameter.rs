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
        Ok(())
    }
}

//! Point at which a Jacobian was evaluated.

use myovib_dae::checks::{expect_finite, expect_positive, expect_vector};
use myovib_dae::{IntegratorError, Linearization};
use serde::{Deserialize, Serialize};

/// Point at which a Jacobian was evaluated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct JacobianPoint {
    t: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    step: f64,
    weights: Vec<f64>,
    /// Response of the internal variables at this point.
    #[serde(default)]
    response: Vec<f64>,
}

impl JacobianPoint {
    /// Stores the point `at` and the `response` at this point. Allocates memory only in the first call.
    pub(super) fn note(&mut self, at: &Linearization<'_>, response: &[f64]) {
        (self.t, self.step) = (at.t, at.step);
        for (stored, new) in [
            (&mut self.y, at.y),
            (&mut self.y_dot, at.y_dot),
            (&mut self.weights, at.weights),
            (&mut self.response, response),
        ] {
            stored.clear();
            stored.extend_from_slice(new);
        }
    }

    /// Validates a saved linearization with `n` unknowns and a response of length `n_response`.
    pub(super) fn validate(&self, n: usize, n_response: usize) -> Result<(), IntegratorError> {
        const WHAT: &str = "Jacobian of the state";
        expect_finite(WHAT, &[self.t, self.step])?;
        for values in [&self.y, &self.y_dot, &self.weights] {
            expect_vector(WHAT, n, values)?;
        }
        for &weight in &self.weights {
            expect_positive("error weight of the state", weight)?;
        }
        expect_vector(WHAT, n_response, &self.response)
    }

    pub(super) fn as_linearization(&self) -> Linearization<'_> {
        Linearization {
            t: self.t,
            y: &self.y,
            y_dot: &self.y_dot,
            step: self.step,
            weights: &self.weights,
        }
    }

    /// Returns the response of the internal variables at this point.
    pub(super) fn response(&self) -> &[f64] {
        &self.response
    }

    /// Returns the total length of the vectors.
    pub(super) fn n_numbers(&self) -> usize {
        self.y.len() + self.y_dot.len() + self.weights.len() + self.response.len()
    }
}

//! Derivatives of a misfit with respect to the solution in one step.

use crate::dense::{Collocation, add_scaled};
use crate::method::Method;

/// A step of the backward pass, to which a misfit J adds its derivatives ∂J/∂y at times within the step or at the
/// stages.
///
/// Multipliers of index 2 and 3 are collocation values; see [`ForwardSensitivities`](super::ForwardSensitivities).
#[derive(Debug)]
pub struct Cotangents<'a> {
    pub(super) method: &'a Method,
    pub(super) step: &'a Collocation,
    pub(super) end: f64,
    pub(super) is_first: bool,
    /// ∂J/∂y and ∂J/∂ẏ at the start of the step.
    pub(super) start: &'a mut [f64],
    pub(super) start_slope: &'a mut [f64],
    /// Derivatives of J with respect to the stage increments.
    pub(super) stages: &'a mut [f64],
}

impl Cotangents<'_> {
    /// Returns the start and end of the step.
    pub fn interval(&self) -> [f64; 2] {
        [self.step.t0, self.end]
    }

    /// Returns whether the step contains the time `t`. The common end of two steps belongs to only one of them.
    pub fn covers(&self, t: f64) -> bool {
        let is_start = self.is_first && t == self.step.t0;
        is_start || (self.step.t0 < t && t <= self.end)
    }

    /// Evaluates the dense output or its first derivative at a time in the step.
    ///
    /// # Panics
    /// Panics if the length of `out` is not the number of unknowns.
    pub fn evaluate(&self, t: f64, derivative: usize, out: &mut [f64]) {
        self.step.evaluate(self.method, t, derivative, out);
    }

    /// Adds ∂J/∂y(t), or ∂J/∂ẏ(t) if `derivative` is 1. The derivatives refer to the values returned by
    /// [`evaluate`](Self::evaluate).
    ///
    /// # Panics
    /// Panics if the length of `cotangent` is not the number of unknowns.
    pub fn add(&mut self, t: f64, derivative: usize, cotangent: &[f64]) {
        assert_eq!(cotangent.len(), self.start.len(), "one for each unknown");
        if derivative == 0 {
            add_scaled(self.start, 1.0, cotangent);
        }
        let (of_slope, of_stages) = self.step.coefficients(self.method, t, derivative);
        add_scaled(self.start_slope, of_slope, cotangent);
        let stages = self.stages.chunks_exact_mut(cotangent.len());
        stages.zip(of_stages).for_each(|(stage, b)| add_scaled(stage, b, cotangent));
    }

    /// Returns the times t_i of the stages and the weights h b_i of the quadrature h Σ_i b_i f(t_i) ≈ ∫ f dt over the
    /// step, which is exact up to degree 2s − 2.
    pub fn quadrature(&self) -> impl Iterator<Item = (f64, f64)> {
        let (t0, h) = (self.step.t0, self.step.h);
        let nodes = self.method.nodes().iter().zip(self.method.weights());
        nodes.map(move |(c, b)| (t0 + c * h, b * h))
    }

    /// Writes y at stage `i`, counted from 0, to `out`.
    ///
    /// # Panics
    /// Panics if the stage does not exist, or if the length of `out` is not the number of unknowns.
    pub fn stage(&self, i: usize, out: &mut [f64]) {
        out.copy_from_slice(&self.step.y0);
        let n = out.len();
        add_scaled(out, 1.0, &self.step.increments[i * n..(i + 1) * n]);
    }

    /// Adds ∂J/∂y at stage `i`.
    ///
    /// # Panics
    /// Panics if the stage does not exist, or if the length of `cotangent` is not the number of unknowns.
    pub fn add_to_stage(&mut self, i: usize, cotangent: &[f64]) {
        let n = self.start.len();
        assert_eq!(cotangent.len(), n, "one for each unknown");
        add_scaled(self.start, 1.0, cotangent);
        add_scaled(&mut self.stages[i * n..(i + 1) * n], 1.0, cotangent);
    }
}

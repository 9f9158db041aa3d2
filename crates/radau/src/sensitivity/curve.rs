//! The sensitivity to one parameter, step by step.

use super::operator::combine;
use crate::dense::{Collocation, add_scaled};
use crate::method::Method;
use crate::predictor::Predictor;

/// The sensitivity to one parameter.
#[derive(Debug)]
pub(super) struct Curve {
    pub(super) s: Vec<f64>,
    s_dot: Vec<f64>,
    /// The polynomial over the last step.
    pub(super) step: Collocation,
    predictor: Predictor,
    guess: Vec<f64>,
    /// What the stage equations lack: −∂F/∂p to begin with.
    pub(super) residual: Vec<f64>,
}

impl Curve {
    /// Starts from ∂y_0/∂p.
    pub(super) fn new(method: &Method, t: f64, s: Vec<f64>) -> Self {
        let (rest, stages) = (vec![0.0; s.len()], vec![0.0; method.stages() * s.len()]);
        Self {
            step: Collocation::line(method, t, &s, &rest),
            s_dot: rest,
            predictor: Predictor::new(method, s.len()),
            guess: stages.clone(),
            residual: stages,
            s,
        }
    }

    /// Makes the step its own, with increments to start from.
    pub(super) fn begin(&mut self, method: &Method, step: &Collocation) {
        let (t, h) = (step.t0, step.h);
        let (last, guess) = (&self.step, &mut self.guess);
        self.predictor.start(method, last, (t, h), &self.s, guess);
        std::mem::swap(&mut self.step.increments, &mut self.guess);
        (self.step.t0, self.step.h) = (t, h);
        self.step.y0.copy_from_slice(&self.s);
        self.step.y_dot0.copy_from_slice(&self.s_dot);
    }

    /// p̄ S at the larger of its sizes before and after the step, as far as they are known: with a
    /// correction of its end that is still in `residual`.
    pub(super) fn size(&self, scale: f64) -> Vec<f64> {
        let last = self.step.increments.len() - self.s.len();
        let increment = self.step.increments[last..]
            .iter()
            .zip(&self.residual[last..]);
        let both = self.s.iter().zip(increment);
        both.map(|(s, (z, c))| scale * s.abs().max((s + z + c).abs()))
            .collect()
    }

    /// Goes to the end of the step, `weights` saying how components count together.
    pub(super) fn end(&mut self, method: &Method, weights: &[f64], is_first: bool) {
        let (n, h) = (self.s.len(), self.step.h);
        self.predictor.learn(&self.step.increments, weights);
        if is_first {
            // Nothing is known of Ṡ at the start.
            let all: Vec<usize> = (0..n).collect();
            self.step.free_start(method, &all);
        }
        let z = &self.step.increments;
        add_scaled(&mut self.s, 1.0, &z[z.len() - n..]);
        combine(method, method.stages() - 1, h, z, &mut self.s_dot);
    }
}

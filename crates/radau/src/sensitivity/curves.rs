//! The sensitivities to all parameters, step by step.

use myovib_dae::columns;

use super::history::{Beginning, History, Weights};
use super::operator::combine;
use crate::dense::Collocation;
use crate::method::Method;
use crate::predictor::Predictor;

/// The sensitivities to all parameters: columns whose numbers stand side by side.
#[derive(Debug)]
pub(super) struct Curves {
    n_columns: usize,
    pub(super) s: Vec<f64>,
    s_dot: Vec<f64>,
    /// The polynomials over the last step.
    pub(super) step: Collocation,
    history: History,
    predictor: Predictor,
    guess: Vec<f64>,
    /// What the stage equations lack: −∂F/∂p to begin with.
    pub(super) residual: Vec<f64>,
    /// What `s` holds, one column after the other.
    apart: Vec<Vec<f64>>,
}

impl Curves {
    /// Starts from the ∂y_0/∂p.
    pub(super) fn new(method: &Method, t: f64, starts: Vec<Vec<f64>>) -> Self {
        let n_columns = starts.len();
        let mut s = vec![0.0; starts.iter().map(Vec::len).sum()];
        for (j, start) in starts.iter().enumerate() {
            columns::put(start, &mut s, j, n_columns);
        }
        let (rest, stages) = (vec![0.0; s.len()], vec![0.0; method.stages() * s.len()]);
        Self {
            n_columns,
            step: Collocation::line(method, t, &s, &rest),
            s_dot: rest,
            history: History::new(s.len(), method.stages()),
            predictor: Predictor::new(method, s.len()),
            guess: stages.clone(),
            residual: stages,
            apart: starts,
            s,
        }
    }

    /// Their number.
    pub(super) fn count(&self) -> usize {
        self.n_columns
    }

    /// That of parameter j.
    pub(super) fn of(&self, j: usize) -> &[f64] {
        &self.apart[j]
    }

    /// Makes the step their own, with increments to start from: the better, the closer to each other the steps
    /// before are to the `tolerance` that the weights are for.
    pub(super) fn begin(
        &mut self,
        method: &Method,
        step: &Collocation,
        weights: &Weights<'_>,
        tolerance: f64,
    ) {
        let (t, h) = (step.t0, step.h);
        let (last, guess) = (&self.step, &mut self.guess);
        match self.history.is_enough(h) {
            true => {
                let now = Beginning {
                    h,
                    columns: [&self.s, &self.s_dot],
                    state: [&step.y0, &step.y_dot0],
                };
                self.predictor.start_with(guess, |z| {
                    self.history.guess(method, &now, weights, tolerance, z);
                });
            }
            false => self.predictor.start(method, last, (t, h), &self.s, guess),
        }
        std::mem::swap(&mut self.step.increments, &mut self.guess);
        (self.step.t0, self.step.h) = (t, h);
        self.step.y0.copy_from_slice(&self.s);
        self.step.y_dot0.copy_from_slice(&self.s_dot);
    }

    /// p̄ S_j at the larger of its sizes before and after the step, as far as they are known: with a
    /// correction of its end that is still in `residual`.
    pub(super) fn size(&self, j: usize, scale: f64, out: &mut [f64]) {
        let last = self.step.increments.len() - self.s.len();
        let end = (&self.step.increments[last..], &self.residual[last..]);
        for (i, out) in out.iter_mut().enumerate() {
            let k = i * self.n_columns + j;
            let (before, after) = (self.s[k], self.s[k] + end.0[k] + end.1[k]);
            *out = scale * before.abs().max(after.abs());
        }
    }

    /// Goes to the end of the step of the state, `weights` saying how components count together.
    pub(super) fn end(
        &mut self,
        method: &Method,
        state: &Collocation,
        weights: &[f64],
        is_first: bool,
    ) {
        let (length, h) = (self.s.len(), self.step.h);
        self.predictor.learn(&self.step.increments, weights);
        if is_first {
            // Nothing is known of Ṡ at the start.
            let all: Vec<usize> = (0..length).collect();
            self.step.free_start(method, &all);
        }
        self.history.push(&self.step, state);
        let z = &self.step.increments;
        let end = self.s.iter_mut().zip(&z[z.len() - length..]);
        end.for_each(|(s, z)| *s += z);
        combine(method, method.stages() - 1, h, z, &mut self.s_dot);
        for (j, apart) in self.apart.iter_mut().enumerate() {
            let own = self.s.iter().skip(j).step_by(self.n_columns);
            apart.iter_mut().zip(own).for_each(|(s, own)| *s = *own);
        }
    }
}

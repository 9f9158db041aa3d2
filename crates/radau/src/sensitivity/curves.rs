//! Sensitivities to all parameters, advanced step by step.

use myovib_dae::columns;

use super::history::{Beginning, History, Vectors};
use super::operator::combine;
use crate::dense::Collocation;
use crate::method::Method;
use crate::predictor::Predictor;

/// Sensitivities to all parameters, stored row by row with one column per parameter.
#[derive(Debug)]
pub(super) struct Curves {
    n_columns: usize,
    pub(super) s: Vec<f64>,
    s_dot: Vec<f64>,
    /// Polynomials of the last step.
    pub(super) step: Collocation,
    history: History,
    predictor: Predictor,
    guess: Vec<f64>,
    /// Residual of the stage equations, initially −∂F/∂p.
    pub(super) residual: Vec<f64>,
    /// Copy of `s`, stored column by column.
    apart: Vec<Vec<f64>>,
}

impl Curves {
    /// Creates the sensitivities from the initial values ∂y_0/∂p.
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
            history: History::new(s.len() / n_columns.max(1), n_columns, method.stages()),
            predictor: Predictor::new(method, s.len()),
            guess: stages.clone(),
            residual: stages,
            apart: starts,
            s,
        }
    }

    /// Returns the number of parameters.
    pub(super) fn count(&self) -> usize {
        self.n_columns
    }

    /// Returns the sensitivity to parameter j.
    pub(super) fn of(&self, j: usize) -> &[f64] {
        &self.apart[j]
    }

    /// Discards the history. This is necessary if the problem has a jump or a kink at this time.
    pub(super) fn forget(&mut self) {
        self.history.clear();
        self.predictor.forget();
    }

    /// Prepares a step with initial guesses for its increments. `weights` contains the weights of the columns and of
    /// the state. Weighted values below `tolerance` are regarded as noise.
    pub(super) fn begin(
        &mut self,
        method: &Method,
        step: &Collocation,
        [columns, state]: [&[f64]; 2],
        tolerance: f64,
    ) {
        let (t, h) = (step.t0, step.h);
        let now = Beginning {
            h,
            columns: Vectors { values: [&self.s, &self.s_dot], weights: columns },
            state: Vectors { values: [&step.y0, &step.y_dot0], weights: state },
            tolerance,
        };
        let (last, history) = (&self.step, &mut self.history);
        self.predictor.start_with(&mut self.guess, |z| {
            if !history.guess(method, &now, z) {
                last.extrapolate(method, t, h, &self.s, z);
            }
        });
        std::mem::swap(&mut self.step.increments, &mut self.guess);
        (self.step.t0, self.step.h) = (t, h);
        self.step.y0.copy_from_slice(&self.s);
        self.step.y_dot0.copy_from_slice(&self.s_dot);
    }

    /// Writes the size of each component of p̄ S_j, the maximum of |p̄ S_j| at the two ends of the step, to `out`. The
    /// value at the end includes the correction in `residual`, which is not yet applied.
    pub(super) fn size(&self, j: usize, scale: f64, out: &mut [f64]) {
        let last = self.step.increments.len() - self.s.len();
        let end = (&self.step.increments[last..], &self.residual[last..]);
        for (i, out) in out.iter_mut().enumerate() {
            let k = i * self.n_columns + j;
            let (before, after) = (self.s[k], self.s[k] + end.0[k] + end.1[k]);
            *out = scale * before.abs().max(after.abs());
        }
    }

    /// Advances to the end of the step. `state` contains the state in this step, and `weights` contains the relative
    /// weights of the components.
    pub(super) fn end(
        &mut self,
        method: &Method,
        state: &Collocation,
        weights: &[f64],
        (is_first, algebraic): (bool, &[usize]),
    ) {
        let (length, h) = (self.s.len(), self.step.h);
        self.predictor.learn(&self.step.increments, weights);
        if is_first {
            // Ṡ is unknown at the start.
            self.step.free_start(method, 0..length);
        } else {
            let rows = algebraic.iter().map(|i| i * self.n_columns..(i + 1) * self.n_columns);
            self.step.free_start(method, rows.flatten());
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

//! Mechanical systems, each defined by its inertia, forces and constraints.

use super::dual::{Differentiable, Dual};
use super::equations::Equations;
use super::{MechanicalForm, Start};

/// Mechanical system M(q) q̈ = f(q, q̇) − G(q)ᵀ λ with the constraints g(q) = 0, where G = ∂g/∂q.
pub trait Mechanism {
    /// Returns the number of positions.
    fn n_positions(&self) -> usize;

    /// Returns the number of constraints.
    fn n_constraints(&self) -> usize;

    /// Evaluates M(q) a.
    fn inertia<S: Differentiable>(&self, q: &[S], a: &[S], out: &mut [S]);

    /// Evaluates f(q, v), including all terms quadratic in v.
    fn force<S: Differentiable>(&self, q: &[S], v: &[S], out: &mut [S]);

    /// Evaluates g(q).
    fn constraint<S: Differentiable>(&self, q: &[S], out: &mut [S]);

    /// Returns initial positions with g(q) = 0 and initial velocities with G v = 0.
    fn start(&self) -> (Vec<f64>, Vec<f64>);
}

/// Equations of a mechanism, with the constraints in one of four forms.
///
/// ```text
/// q̇ = v,  M v̇ = f − Gᵀ λ,
/// index 3:    g(q) = 0
/// index 2:    G v = 0 instead
/// index 1:    d²g/dt² = 0 instead
/// stabilized: g = 0 and G v = 0, with q̇ = v − Gᵀ μ
/// ```
///
/// The unknowns are (q, v, λ), followed by μ in the stabilized form.
#[derive(Debug, Clone, Copy)]
pub struct Constrained<M> {
    mechanism: M,
    form: MechanicalForm,
}

impl<M: Mechanism> Constrained<M> {
    /// Creates the equations of `mechanism`, with the constraints in the given form.
    pub fn new(mechanism: M, form: MechanicalForm) -> Self {
        Self { mechanism, form }
    }

    /// Subtracts G(q)ᵀ m from `out`.
    fn subtract_reaction<S: Differentiable>(&self, q: &[S], m: &[S], out: &mut [S]) {
        let mut along: Vec<Dual<S>> = q.iter().map(|&q| Dual::new(q, S::from(0.0))).collect();
        let mut g = vec![Dual::from(0.0); self.mechanism.n_constraints()];
        for (j, out) in out.iter_mut().enumerate() {
            along[j].slope = S::from(1.0);
            self.mechanism.constraint(&along, &mut g);
            along[j].slope = S::from(0.0);
            for (g, &m) in g.iter().zip(m) {
                *out = *out - g.slope * m;
            }
        }
    }

    /// Evaluates G(q) v.
    fn constraint_rate<S: Differentiable>(&self, q: &[S], v: &[S], out: &mut [S]) {
        let pairs = q.iter().zip(v);
        let along: Vec<_> = pairs.map(|(&q, &v)| Dual::new(q, v)).collect();
        let mut g = vec![Dual::from(0.0); out.len()];
        self.mechanism.constraint(&along, &mut g);
        for (out, g) in out.iter_mut().zip(g) {
            *out = g.slope;
        }
    }

    /// Evaluates d²g/dt² = G a + Ġ v.
    fn constraint_acceleration<S: Differentiable>(&self, q: &[S], v: &[S], a: &[S], out: &mut [S]) {
        let along = |x: &[S], rate: &[S]| -> Vec<Dual<S>> {
            let pairs = x.iter().zip(rate);
            pairs.map(|(&x, &rate)| Dual::new(x, rate)).collect()
        };
        let mut rate = vec![Dual::from(0.0); out.len()];
        self.constraint_rate(&along(q, v), &along(v, a), &mut rate);
        for (out, rate) in out.iter_mut().zip(rate) {
            *out = rate.slope;
        }
    }

    /// Returns the accelerations and multipliers that satisfy the equations of index 1 at (q, v). These equations are
    /// linear in the accelerations and multipliers.
    fn accelerations(&self, q: &[f64], v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (n, m) = (q.len(), self.mechanism.n_constraints());
        let residual = |unknowns: &[f64]| {
            let (a, lambda) = unknowns.split_at(n);
            let mut out = vec![0.0; n + m];
            let (forces, g) = out.split_at_mut(n);
            self.balance(q, v, a, lambda, forces);
            self.constraint_acceleration(q, v, a, g);
            out
        };
        let constant = residual(&vec![0.0; n + m]);
        let mut matrix = vec![vec![0.0; n + m]; n + m];
        for j in 0..n + m {
            let mut unit = vec![0.0; n + m];
            unit[j] = 1.0;
            for (i, value) in residual(&unit).into_iter().enumerate() {
                matrix[i][j] = value - constant[i];
            }
        }
        let mut solution = eliminate(matrix, constant.iter().map(|c| -c).collect());
        let lambda = solution.split_off(n);
        (solution, lambda)
    }

    /// Evaluates M a − f + Gᵀ λ.
    fn balance<S: Differentiable>(&self, q: &[S], v: &[S], a: &[S], lambda: &[S], out: &mut [S]) {
        let mut force = vec![S::from(0.0); q.len()];
        self.mechanism.force(q, v, &mut force);
        self.subtract_reaction(q, lambda, &mut force);
        self.mechanism.inertia(q, a, out);
        for (out, force) in out.iter_mut().zip(force) {
            *out = *out - force;
        }
    }
}

impl<M: Mechanism> Equations for Constrained<M> {
    fn n_unknowns(&self) -> usize {
        let multipliers = match self.form {
            MechanicalForm::Stabilized => 2,
            _ => 1,
        };
        2 * self.mechanism.n_positions() + multipliers * self.mechanism.n_constraints()
    }

    fn residual<S: Differentiable>(&self, _t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let (n, m) = (self.mechanism.n_positions(), self.mechanism.n_constraints());
        let (q, v, multipliers) = (&y[..n], &y[n..2 * n], &y[2 * n..]);
        let (lambda, mu) = multipliers.split_at(m);
        let (kinematics, rest) = residual.split_at_mut(n);
        let (forces, constraints) = rest.split_at_mut(n);
        let (q_dot, v_dot) = (&y_dot[..n], &y_dot[n..2 * n]);
        kinematics.copy_from_slice(v);
        self.subtract_reaction(q, mu, kinematics);
        for (r, &rate) in kinematics.iter_mut().zip(q_dot) {
            *r = rate - *r;
        }
        self.balance(q, v, v_dot, lambda, forces);
        match self.form {
            MechanicalForm::Index3 => self.mechanism.constraint(q, constraints),
            MechanicalForm::Index2 => self.constraint_rate(q, v, constraints),
            MechanicalForm::Index1 => self.constraint_acceleration(q, v, v_dot, constraints),
            MechanicalForm::Stabilized => {
                let (g, rate) = constraints.split_at_mut(m);
                self.mechanism.constraint(q, g);
                self.constraint_rate(q, v, rate);
            }
        }
    }

    fn n_differential(&self) -> usize {
        2 * self.mechanism.n_positions()
    }

    fn indices(&self) -> Vec<u8> {
        let (n, m) = (self.mechanism.n_positions(), self.mechanism.n_constraints());
        self.form.indices(n, m)
    }

    fn start(&self) -> Start {
        let (q, v) = self.mechanism.start();
        let (a, lambda) = self.accelerations(&q, &v);
        let mut y = [&q[..], &v, &lambda].concat();
        let mut y_dot = [v, a].concat();
        y.resize(self.n_unknowns(), 0.0);
        y_dot.resize(self.n_unknowns(), 0.0);
        Start { t: 0.0, y, y_dot }
    }
}

/// Solves a linear system by elimination with row pivoting.
fn eliminate(mut matrix: Vec<Vec<f64>>, mut rhs: Vec<f64>) -> Vec<f64> {
    let n = rhs.len();
    for k in 0..n {
        let largest = |&i: &usize, &j: &usize| matrix[i][k].abs().total_cmp(&matrix[j][k].abs());
        let pivot = (k..n).max_by(largest).unwrap_or(k);
        matrix.swap(k, pivot);
        rhs.swap(k, pivot);
        let (above, below) = matrix.split_at_mut(k + 1);
        for (i, row) in below.iter_mut().enumerate() {
            let factor = row[k] / above[k][k];
            for (entry, pivot) in row.iter_mut().zip(&above[k]) {
                *entry -= factor * pivot;
            }
            rhs[k + 1 + i] -= factor * rhs[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| matrix[k][j] * rhs[j]).sum();
        rhs[k] = (rhs[k] - known) / matrix[k][k];
    }
    rhs
}

//! The stage equations, linearised at the stages.

use myovib_dae::{Jacobian, Linearization, Parameters, Problem, StepError};

use super::nonzeros::Nonzeros;
use crate::dense::{Collocation, add_scaled};
use crate::method::Method;

/// The derivative of the stage equations with respect to the stage increments,
///
/// ```text
/// (L x)_i = J_y(i) x_i + h⁻¹ J_ẏ(i) Σ_j (A⁻¹)_ij x_j,
/// ```
///
/// with the Jacobians at each stage i, not frozen at the beginning of the step.
#[derive(Debug)]
pub(super) struct StageOperator {
    jacobian: Jacobian,
    /// Where ∂F/∂y and ∂F/∂ẏ are not zero.
    nonzeros: [Nonzeros; 2],
    /// Both at each stage, compressed; then those at the beginning of the step, where they are wanted.
    parts: Vec<[Vec<f64>; 2]>,
    /// t, Y_i and Ẏ_i; likewise.
    pub(super) stages: Vec<Stage>,
    value: Vec<f64>,
    rate: Vec<f64>,
    h: f64,
}

/// Where the equations hold.
#[derive(Debug, Clone)]
pub(super) struct Stage {
    pub(super) t: f64,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
}

impl Stage {
    /// Room for `n` unknowns.
    pub(super) fn new(n: usize) -> Self {
        Self {
            t: 0.0,
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
        }
    }

    /// Becomes stage `i` of a step.
    pub(super) fn move_to(&mut self, method: &Method, step: &Collocation, i: usize) {
        let n = self.y.len();
        self.t = step.t0 + method.nodes()[i] * step.h;
        self.y.copy_from_slice(&step.y0);
        add_scaled(&mut self.y, 1.0, &step.increments[i * n..(i + 1) * n]);
        combine(method, i, step.h, &step.increments, &mut self.y_dot);
    }
}

impl StageOperator {
    pub(super) fn new<P: Problem>(problem: &P, method: &Method) -> Self {
        let (n, s) = (problem.n_unknowns(), method.stages());
        let jacobian = Jacobian::of(problem);
        let pattern = jacobian.pattern();
        let room = vec![0.0; pattern.nnz()];
        let stage = Stage::new(n);
        Self {
            nonzeros: [Nonzeros::new(pattern), Nonzeros::new(pattern)],
            parts: vec![[room.clone(), room]; s],
            stages: vec![stage; s],
            value: vec![0.0; n],
            rate: vec![0.0; n],
            h: 0.0,
            jacobian,
        }
    }

    /// Makes room for the beginning of the step too.
    pub(super) fn add_start(&mut self, method: &Method) {
        self.parts
            .resize(method.stages() + 1, self.parts[0].clone());
        self.stages
            .resize(method.stages() + 1, self.stages[0].clone());
    }

    /// Linearises at the stages of a step, and at its beginning if there is room for that.
    pub(super) fn linearise<P: Problem>(
        &mut self,
        (problem, parameters): (&mut P, &mut impl Parameters<P>),
        method: &Method,
        step: &Collocation,
        weights: &[f64],
    ) -> Result<(), StepError> {
        self.h = step.h;
        for (i, stage) in self.stages.iter_mut().enumerate() {
            match method.nodes().get(i) {
                Some(_) => stage.move_to(method, step, i),
                None => {
                    stage.t = step.t0;
                    stage.y.copy_from_slice(&step.y0);
                    step.start_slope(method, &mut stage.y_dot);
                }
            }
            let at = Linearization {
                t: stage.t,
                y: &stage.y,
                y_dot: &stage.y_dot,
                step: step.h,
                weights,
            };
            let [of_value, of_rate] = &mut self.parts[i];
            let jacobian = &mut self.jacobian;
            parameters.linearise(problem, jacobian, &at, [of_value, of_rate])?;
        }
        for (k, nonzeros) in self.nonzeros.iter_mut().enumerate() {
            let matrices = self.parts.iter().map(|parts| &parts[k][..]);
            nonzeros.learn(self.jacobian.pattern(), matrices);
            let matrices = self.parts.iter_mut();
            matrices.for_each(|parts| nonzeros.compress(&mut parts[k]));
        }
        Ok(())
    }

    /// Subtracts L x from `out`, and J_y(i) `start` at each stage.
    pub(super) fn subtract(
        &mut self,
        method: &Method,
        start: Option<&[f64]>,
        x: &[f64],
        out: &mut [f64],
    ) {
        let n = self.rate.len();
        let [by_value, by_rate] = &self.nonzeros;
        for (i, out) in out.chunks_exact_mut(n).enumerate() {
            let [of_value, of_rate] = &self.parts[i];
            let mut value = &x[i * n..(i + 1) * n];
            if let Some(start) = start {
                self.value.copy_from_slice(start);
                add_scaled(&mut self.value, 1.0, value);
                value = &self.value;
            }
            by_value.subtract(of_value, value, out);
            combine(method, i, self.h, x, &mut self.rate);
            by_rate.subtract(of_rate, &self.rate, out);
        }
    }

    /// Subtracts Lᵀ x from `out`.
    pub(super) fn subtract_transposed(&mut self, method: &Method, x: &[f64], out: &mut [f64]) {
        let n = self.rate.len();
        let [by_value, by_rate] = &self.nonzeros;
        for (i, (x, [of_value, of_rate])) in x.chunks_exact(n).zip(&self.parts).enumerate() {
            by_value.subtract_transposed(of_value, x, &mut out[i * n..(i + 1) * n]);
            self.rate.fill(0.0);
            by_rate.subtract_transposed(of_rate, x, &mut self.rate);
            for (j, out) in out.chunks_exact_mut(n).enumerate() {
                add_scaled(out, method.a_inverse(i, j) / self.h, &self.rate);
            }
        }
    }

    /// Subtracts Σ_i J_y(i)ᵀ x_i from `start`.
    pub(super) fn subtract_transposed_from_start(&self, x: &[f64], start: &mut [f64]) {
        let stages = x.chunks_exact(self.rate.len()).zip(&self.parts);
        for (x, [of_value, _]) in stages {
            self.nonzeros[0].subtract_transposed(of_value, x, start);
        }
    }

    /// Subtracts J_y s + J_ẏ u'(t_n) from `out`, at the beginning of the step of the curve u that
    /// starts from s.
    pub(super) fn subtract_at_start(
        &mut self,
        method: &Method,
        curve: &Collocation,
        out: &mut [f64],
    ) {
        let [by_value, by_rate] = &self.nonzeros;
        let [of_value, of_rate] = &self.parts[method.stages()];
        by_value.subtract(of_value, &curve.y0, out);
        curve.start_slope(method, &mut self.rate);
        by_rate.subtract(of_rate, &self.rate, out);
    }
}

/// h⁻¹ Σ_j (A⁻¹)_ij z_j
pub(super) fn combine(method: &Method, i: usize, h: f64, z: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (j, z_j) in z.chunks_exact(out.len()).enumerate() {
        add_scaled(out, method.a_inverse(i, j) / h, z_j);
    }
}

//! The stage equations, linearised at the stages.

use myovib_dae::{Jacobian, Linearization, Parameters, Problem, StepError};

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
    /// ∂F/∂y and ∂F/∂ẏ at each stage, in the order of the pattern.
    parts: Vec<[Vec<f64>; 2]>,
    /// t, Y_i and Ẏ_i.
    pub(super) stages: Vec<Stage>,
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

impl StageOperator {
    pub(super) fn new<P: Problem>(problem: &P, method: &Method) -> Self {
        let (n, s) = (problem.n_unknowns(), method.stages());
        let jacobian = Jacobian::of(problem);
        let nnz = jacobian.pattern().nnz();
        let stage = Stage {
            t: 0.0,
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
        };
        Self {
            jacobian,
            parts: vec![[vec![0.0; nnz], vec![0.0; nnz]]; s],
            stages: vec![stage; s],
            rate: vec![0.0; n],
            h: 0.0,
        }
    }

    /// Linearises at the stages of a step.
    pub(super) fn linearise<P: Problem>(
        &mut self,
        (problem, parameters): (&mut P, &mut impl Parameters<P>),
        method: &Method,
        step: &Collocation,
        weights: &[f64],
    ) -> Result<(), StepError> {
        self.h = step.h;
        let n = step.y0.len();
        for (i, stage) in self.stages.iter_mut().enumerate() {
            stage.t = step.t0 + method.nodes()[i] * step.h;
            stage.y.copy_from_slice(&step.y0);
            add_scaled(&mut stage.y, 1.0, &step.increments[i * n..(i + 1) * n]);
            combine(method, i, step.h, &step.increments, &mut stage.y_dot);
            let at = Linearization {
                t: stage.t,
                y: &stage.y,
                y_dot: &stage.y_dot,
                step: step.h,
                weights,
            };
            let [of_value, of_rate] = &mut self.parts[i];
            parameters.linearise(problem, &mut self.jacobian, &at, [of_value, of_rate])?;
        }
        Ok(())
    }

    /// Writes L x.
    pub(super) fn apply(&mut self, method: &Method, x: &[f64], out: &mut [f64]) {
        let n = self.rate.len();
        for (i, out) in out.chunks_exact_mut(n).enumerate() {
            combine(method, i, self.h, x, &mut self.rate);
            out.fill(0.0);
            let [of_value, of_rate] = &self.parts[i];
            self.add_product(of_value, &x[i * n..(i + 1) * n], out);
            self.add_product(of_rate, &self.rate, out);
        }
    }

    /// Adds ∂F/∂y(i) x to `out`.
    pub(super) fn add_of_value(&self, i: usize, x: &[f64], out: &mut [f64]) {
        self.add_product(&self.parts[i][0], x, out);
    }

    fn add_product(&self, values: &[f64], x: &[f64], out: &mut [f64]) {
        let pattern = self.jacobian.pattern();
        let (offsets, rows) = (pattern.major_offsets(), pattern.minor_indices());
        for (x, column) in x.iter().zip(offsets.windows(2)) {
            let entries = column[0]..column[1];
            for (&row, value) in rows[entries.clone()].iter().zip(&values[entries]) {
                out[row] += value * x;
            }
        }
    }
}

/// h⁻¹ Σ_j (A⁻¹)_ij z_j
pub(super) fn combine(method: &Method, i: usize, h: f64, z: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (j, z_j) in z.chunks_exact(out.len()).enumerate() {
        add_scaled(out, method.a_inverse(i, j) / h, z_j);
    }
}

//! Stage equations, linearized at the stages.

use myovib_dae::{Jacobian, Linearization, Parameters, Problem, StepError};

use super::nonzeros::Nonzeros;
use crate::dense::{Collocation, add_combined, add_scaled, write_combined};
use crate::method::Method;

/// Derivative of the stage equations with respect to the stage increments,
///
/// ```text
/// (L x)_i = J_y(i) x_i + h⁻¹ J_ẏ(i) Σ_j (A⁻¹)_ij x_j,
/// ```
///
/// with a separate Jacobian at each stage i instead of a frozen Jacobian at the start of the step.
#[derive(Debug)]
pub(super) struct StageOperator {
    jacobian: Jacobian,
    /// Nonzero entries of ∂F/∂y and ∂F/∂ẏ.
    nonzeros: [Nonzeros; 2],
    /// Both matrices in compressed form at each stage and, optionally, at the start of the step.
    parts: Vec<[Vec<f64>; 2]>,
    /// t, Y_i and Ẏ_i at these points.
    pub(super) stages: Vec<Stage>,
    /// Number of points.
    stages_and_start: usize,
    /// Whether the `parameters` store the tangents.
    is_kept: bool,
    value: Vec<f64>,
    rates: Vec<f64>,
    h: f64,
}

/// Point (t, y, ẏ) at which the equations hold.
#[derive(Debug, Clone)]
pub(super) struct Stage {
    pub(super) t: f64,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
}

impl Stage {
    /// Allocates a point for `n` unknowns.
    pub(super) fn new(n: usize) -> Self {
        Self { t: 0.0, y: vec![0.0; n], y_dot: vec![0.0; n] }
    }

    /// Moves the point to stage `i` of a step.
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
        let stage = Stage::new(n);
        Self {
            nonzeros: [Nonzeros::new(pattern), Nonzeros::new(pattern)],
            parts: Vec::new(),
            stages: vec![stage; s],
            stages_and_start: s,
            is_kept: false,
            value: Vec::new(),
            rates: Vec::new(),
            h: 0.0,
            jacobian,
        }
    }

    /// Returns the number of residual evaluations for difference quotients so far.
    pub(super) fn difference_evaluations(&self) -> u64 {
        self.jacobian.residual_evaluations()
    }

    /// Adds the start of the step as a point.
    pub(super) fn add_start(&mut self, method: &Method) {
        self.stages_and_start = method.stages() + 1;
        self.stages.resize(self.stages_and_start, self.stages[0].clone());
    }

    /// Linearizes the equations at the stages of a step, and also at its start if the start was added.
    ///
    /// The `parameters` may store the tangents themselves for later [products](Self::subtract). If transposed products
    /// are needed, this requires that the parameters support them.
    pub(super) fn linearize<P: Problem>(
        &mut self,
        (problem, parameters): (&mut P, &mut impl Parameters<P>),
        method: &Method,
        step: &Collocation,
        weights: &[f64],
        is_transposed: bool,
    ) -> Result<(), StepError> {
        self.h = step.h;
        self.is_kept = false;
        let may_keep = !is_transposed || parameters.transposes_tangents();
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
            if may_keep && parameters.keep_tangents(problem, i, &at)? {
                self.is_kept = true;
                continue;
            }
            if self.parts.is_empty() {
                let zeros = vec![0.0; self.jacobian.pattern().nnz()];
                self.parts = vec![[zeros.clone(), zeros]; self.stages_and_start];
            }
            let [df_dy, df_dyp] = &mut self.parts[i];
            let jacobian = &mut self.jacobian;
            parameters.linearize(problem, jacobian, &at, [df_dy, df_dyp])?;
        }
        if self.is_kept {
            return Ok(());
        }
        for (k, nonzeros) in self.nonzeros.iter_mut().enumerate() {
            let matrices = self.parts.iter().map(|parts| &parts[k][..]);
            nonzeros.learn(self.jacobian.pattern(), matrices);
            let matrices = self.parts.iter_mut();
            matrices.for_each(|parts| nonzeros.compress(&mut parts[k]));
        }
        Ok(())
    }

    /// Subtracts L x and, at each stage, J_y(i) `start` from `out`, for `n_columns` columns stored row by row.
    pub(super) fn subtract<P>(
        &mut self,
        parameters: &mut impl Parameters<P>,
        method: &Method,
        (start, x): (Option<&[f64]>, &[f64]),
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let n = x.len() / method.stages();
        let h = self.h;
        self.rates.resize(x.len(), 0.0);
        write_combined(&mut self.rates, n, |i, j| method.a_inverse(i, j) / h, x);
        for (i, out) in out.chunks_exact_mut(n).enumerate() {
            let mut value = &x[i * n..(i + 1) * n];
            if let Some(start) = start {
                self.value.clear();
                self.value.extend(start.iter().zip(value).map(|(s, x)| s + x));
                value = &self.value;
            }
            let rate = &self.rates[i * n..(i + 1) * n];
            self.subtract_at(parameters, i, [value, rate], out, n_columns)?;
        }
        Ok(())
    }

    /// Subtracts Lᵀ x from `out`.
    pub(super) fn subtract_transposed<P>(
        &mut self,
        parameters: &mut impl Parameters<P>,
        method: &Method,
        x: &[f64],
        out: &mut [f64],
    ) {
        let n = x.len() / method.stages();
        let mut rates = std::mem::take(&mut self.rates);
        rates.clear();
        rates.resize(x.len(), 0.0);
        let both = out.chunks_exact_mut(n).zip(rates.chunks_exact_mut(n));
        for (i, (x, (value, rate))) in x.chunks_exact(n).zip(both).enumerate() {
            self.subtract_transposed_at(parameters, i, x, [value, rate]);
        }
        let h = self.h;
        add_combined(out, n, |j, i| method.a_inverse(i, j) / h, &rates);
        self.rates = rates;
    }

    /// Subtracts Σ_i J_y(i)ᵀ x_i from `start`.
    pub(super) fn subtract_transposed_from_start<P>(
        &mut self,
        parameters: &mut impl Parameters<P>,
        x: &[f64],
        start: &mut [f64],
    ) {
        let n = start.len();
        let mut unused = std::mem::take(&mut self.rates);
        unused.resize(n.max(unused.len()), 0.0);
        for (i, x) in x.chunks_exact(n).enumerate() {
            self.subtract_transposed_at(parameters, i, x, [&mut *start, &mut unused[..n]]);
        }
        self.rates = unused;
    }

    /// Subtracts J_yᵀ x and J_ẏᵀ x at one point from the two vectors in `out`.
    fn subtract_transposed_at<P>(
        &self,
        parameters: &mut impl Parameters<P>,
        place: usize,
        x: &[f64],
        [value, rate]: [&mut [f64]; 2],
    ) {
        if self.is_kept {
            return parameters.subtract_transposed_tangents(place, x, [value, rate]);
        }
        let [by_value, by_rate] = &self.nonzeros;
        let [df_dy, df_dyp] = &self.parts[place];
        by_value.subtract_transposed(df_dy, x, value);
        by_rate.subtract_transposed(df_dyp, x, rate);
    }

    /// Subtracts J_y s + J_ẏ u'(t_n) at the start of the step from `out`, where u denotes the polynomials that start
    /// from s.
    pub(super) fn subtract_at_start<P>(
        &mut self,
        parameters: &mut impl Parameters<P>,
        method: &Method,
        curves: &Collocation,
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let mut slope = vec![0.0; out.len()];
        curves.start_slope(method, &mut slope);
        let at = [&curves.y0[..], &slope];
        self.subtract_at(parameters, method.stages(), at, out, n_columns)
    }

    /// Subtracts J_y x + J_ẏ ẋ at one point from `out`.
    fn subtract_at<P>(
        &self,
        parameters: &mut impl Parameters<P>,
        place: usize,
        [value, rate]: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        if self.is_kept {
            return parameters.subtract_tangents(place, [value, rate], out, n_columns);
        }
        let [by_value, by_rate] = &self.nonzeros;
        let [df_dy, df_dyp] = &self.parts[place];
        by_value.subtract(df_dy, value, out, n_columns);
        by_rate.subtract(df_dyp, rate, out, n_columns);
        Ok(())
    }
}

/// Computes h⁻¹ Σ_j (A⁻¹)_ij z_j.
pub(super) fn combine(method: &Method, i: usize, h: f64, z: &[f64], out: &mut [f64]) {
    write_combined(out, out.len(), |_, j| method.a_inverse(i, j) / h, z);
}

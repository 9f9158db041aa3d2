//! Error estimate of a step.

use myovib_dae::{LinearSolver, Problem, VariableKind};

use crate::dense::{add_scaled, start_slope};
use crate::failure::{Failure, Operation};
use crate::internal_variables::EliminatedVariables;
use crate::newton::{Step, evaluate, norm};
use crate::work::Counters;

/// Number of points at which to search for undetected inputs, in a step as long as the previous one.
const POINTS: f64 = 10.0;

/// Workspace for the error estimate.
///
/// The collocation polynomial u satisfies F = 0 at all nodes, but not at t_n. The estimate is the residual of u at t_n,
/// filtered by the real Newton matrix:
///
/// ```text
/// err = −(J_y + γ/h J_ẏ)⁻¹ F(t_n, y_n, u'(t_n)),   u'(t_n) = h⁻¹ Σ_j ℓ_j'(0) z_j,
/// ```
///
/// where γ is the real eigenvalue of A⁻¹. For M ẏ = f(t, y), this is (IV.8.19) in Hairer & Wanner, the difference from
/// an embedded method of order s. This form does not require f and M separately. The estimate is O(h^(s+1)).
/// In a first or repeated step, a large estimate is filtered a second time, with F(t_n, y_n + err, u'(t_n)), see
/// (IV.8.20).
#[derive(Debug)]
pub(crate) struct ErrorTest {
    y_dot: Vec<f64>,
    shifted: Vec<f64>,
    /// Error estimate.
    error: Vec<f64>,
    residual: Vec<f64>,
    between: Vec<f64>,
    /// 1 for components included in the error test, 0 for excluded components.
    mask: Vec<f64>,
}

impl ErrorTest {
    pub(crate) fn new(mask: Vec<f64>) -> Self {
        let n = mask.len();
        Self {
            y_dot: vec![0.0; n],
            shifted: vec![0.0; n],
            error: vec![0.0; n],
            residual: vec![0.0; n],
            between: vec![0.0; n],
            mask,
        }
    }

    /// Returns the weighted norm of the estimated error of the step with increments `z`. The norm is not finite if a
    /// solve has overflowed.
    pub(crate) fn estimate<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        mut internal: Option<&mut EliminatedVariables<P>>,
        step: &Step<'_>,
        (z, filter_twice): (&[f64], bool),
        counters: &mut Counters,
    ) -> Result<f64, Failure> {
        start_slope(step.method, step.h, z, &mut self.y_dot);
        let (t, v, of_step) = (step.t, &self.y_dot, (step.method, step.h));
        if let Some(internal) = &mut internal {
            internal.show_condensed(problem, of_step, None)?;
        }
        evaluate(problem, t, step.y, v, &mut self.error, counters)?;
        let mut norm = self.filter(problem, matrices, step, counters)?;
        if let Some(internal) = &mut internal {
            norm = norm.hypot(internal.estimate(problem, of_step, &self.error, false));
        }
        if norm < 1.0 || !norm.is_finite() || !filter_twice {
            return Ok(norm);
        }
        self.shifted.copy_from_slice(step.y);
        add_scaled(&mut self.shifted, 1.0, &self.error);
        let (y, v) = (&self.shifted, &self.y_dot);
        if let Some(internal) = &mut internal {
            internal.show_condensed(problem, of_step, Some((t, y)))?;
        }
        evaluate(problem, t, y, v, &mut self.error, counters)?;
        let norm = self.filter(problem, matrices, step, counters)?;
        Ok(internal.map_or(norm, |internal| {
            norm.hypot(internal.estimate(problem, of_step, &self.error, true))
        }))
    }

    /// Returns weighted norms of the filtered residual between the stages, over the differential variables and over the
    /// algebraic variables.
    ///
    /// For differential variables, the residual is summed over points of the step. For a smooth solution, the residual
    /// changes sign at the nodes, and the sum is smaller than the estimate at t_n. For algebraic variables, the maximum
    /// over the points is used, because a short input that acts on them does not affect the interpolated differential
    /// variables. If the step size has `grown` by a factor, the number of points increases by the same factor, so that
    /// the distance between points does not grow.
    pub(crate) fn between<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        (z, kinds, grown): (&[f64], &[VariableKind], f64),
        counters: &mut Counters,
    ) -> Result<[f64; 2], Failure> {
        let (n, method) = (step.y.len(), step.method);
        self.between.fill(0.0);
        let of = |kind: VariableKind| (0..n).filter(move |&i| kinds[i] == kind);
        let (has_algebraic, mut algebraic) = (kinds.contains(&VariableKind::Algebraic), 0.0_f64);
        let points = (POINTS * grown).max(POINTS).ceil();
        for point in 1..=points as usize {
            let theta = point as f64 / (points + 1.0);
            self.shifted.copy_from_slice(step.y);
            self.y_dot.fill(0.0);
            for (j, z) in z.chunks_exact(n).enumerate() {
                add_scaled(&mut self.shifted, method.basis(j, theta), z);
                let slope = method.basis_derivative(j, theta) / step.h;
                add_scaled(&mut self.y_dot, slope, z);
            }
            let (t, y, v) = (step.t + theta * step.h, &self.shifted, &self.y_dot);
            evaluate(problem, t, y, v, &mut self.residual, counters)?;
            add_scaled(&mut self.between, POINTS / points, &self.residual);
            if has_algebraic {
                let solved = matrices.solve_real(problem, &mut self.residual);
                solved.map_err(Operation::LinearSolve.failed())?;
                counters.work.real_solves += 1;
                let errors = of(VariableKind::Algebraic);
                let errors = errors.map(|i| self.residual[i] * self.mask[i] * step.weights[i]);
                algebraic = algebraic.max(norm(errors, n));
            }
        }
        matrices.solve_real(problem, &mut self.between).map_err(Operation::LinearSolve.failed())?;
        counters.work.real_solves += 1;
        let errors = of(VariableKind::Differential);
        let errors = errors.map(|i| self.between[i] * self.mask[i] * step.weights[i]);
        Ok([norm(errors, n), algebraic])
    }

    /// Replaces the residual by the estimate and returns the norm of the estimate.
    fn filter<P, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        counters: &mut Counters,
    ) -> Result<f64, Failure> {
        matrices.solve_real(problem, &mut self.error).map_err(Operation::LinearSolve.failed())?;
        counters.work.real_solves += 1;
        self.error.iter_mut().for_each(|e| *e = -*e);
        let n = self.error.len();
        Ok(norm((0..n).map(|i| self.error(i) * step.weights[i]), n))
    }

    /// Returns 1 for components included in the error test, 0 for excluded components.
    pub(crate) fn mask(&self) -> &[f64] {
        &self.mask
    }

    /// Returns the last estimate, and u'(t_n) of this step.
    pub(crate) fn at_start(&self) -> [&[f64]; 2] {
        [&self.error, &self.y_dot]
    }

    /// Returns the last estimate for component i, or 0 if it is excluded.
    pub(crate) fn error(&self, i: usize) -> f64 {
        self.error[i] * self.mask[i]
    }
}

#[cfg(test)]
mod tests {
    use myovib_dae::{Linearization, StepError};
    use myovib_sparse::SparseOptions;
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::matrices::SparseDirectSolver;
    use crate::method::Method;

    /// ẏ = t^s
    struct Power(i32);

    impl Problem for Power {
        fn n_unknowns(&self) -> usize {
            1
        }

        fn residual(
            &mut self,
            t: f64,
            _: &[f64],
            v: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r[0] = v[0] - t.powi(self.0);
            Ok(())
        }
    }

    /// ẏ = −y
    struct Decay;

    impl Problem for Decay {
        fn n_unknowns(&self) -> usize {
            1
        }

        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            v: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r[0] = v[0] + y[0];
            Ok(())
        }
    }

    /// Returns the estimate for the step of size h from t = 0 and y, with increments z.
    fn estimate(problem: &mut impl Problem, method: &Method, h: f64, y: f64, z: &[f64]) -> f64 {
        let pattern = problem.jacobian_pattern();
        let mut matrices = SparseDirectSolver::new(&pattern, SparseOptions::default()).unwrap();
        let at = Linearization { t: 0.0, y: &[y], y_dot: &[0.0], step: h, weights: &[1e6] };
        matrices.evaluate(problem, &at).unwrap();
        let gamma = method.real_mode().lambda;
        matrices.set_up(problem, gamma / h, &[]).unwrap();
        let step = Step { method, t: 0.0, h, y: &[y], weights: &[1.0] };
        let (mut test, mut counters) = (ErrorTest::new(vec![1.0]), Counters::default());
        let estimated =
            test.estimate(problem, &mut matrices, None, &step, (z, false), &mut counters);
        estimated.unwrap();
        test.error(0)
    }

    /// Checks the estimate for ẏ = t^s from t = 0. The quadrature of the embedded method has order s. Its error for
    /// ∫ t^s equals the residual at 0, −Π(0 − c_i) h^s, times h/γ.
    #[test]
    fn the_estimate_is_the_error_of_the_embedded_method() {
        for stages in [1, 3, 5, 7] {
            let method = Method::radau_iia(stages).unwrap();
            let s = stages as i32;
            for h in [0.5, 2.0_f64] {
                let a = DMatrix::from_fn(stages, stages, |i, j| method.a_inverse(i, j));
                let rates = method.nodes().iter().map(|c| h * (c * h).powi(s));
                let rates = DVector::from_iterator(stages, rates);
                let z = a.lu().solve(&rates).unwrap();
                let estimated = estimate(&mut Power(s), &method, h, 0.0, z.as_slice());
                let product: f64 = method.nodes().iter().map(|c| -c).product();
                let exact = h.powi(s + 1) * product / method.real_mode().lambda;
                // The Jacobian from difference quotients is accurate to half of the digits.
                let ratio = estimated / exact;
                assert!((ratio - 1.0).abs() < 1e-6, "s = {s}, h = {h}: {ratio}");
            }
        }
    }

    /// Compares the estimate with the true error of a step of ẏ = −y from 1. To leading order, the true error is s! (s
    /// − 1)!/((2s − 1)! (2s)!) h^(2s), the error of the Padé approximation with degrees s − 1 and s. The estimate has
    /// the order s + 1 and is the error of y_1 + err.
    #[test]
    fn the_estimate_bounds_the_true_error_of_a_step_by_the_order_it_has() {
        // The second number is the largest step size. At half of this size, the true error still exceeds rounding.
        for (stages, largest) in [(3, 0.2_f64), (5, 1.0), (7, 3.0)] {
            let method = Method::radau_iia(stages).unwrap();
            let errors = [largest, 0.5 * largest].map(|h| {
                // h⁻¹ A⁻¹ z = −(1 + z)
                let matrix = DMatrix::from_fn(stages, stages, |i, j| {
                    method.a_inverse(i, j) / h + f64::from(u8::from(i == j))
                });
                let z = matrix.lu().solve(&DVector::from_element(stages, -1.0)).unwrap();
                let end = 1.0 + z[stages - 1];
                let estimated = estimate(&mut Decay, &method, h, 1.0, z.as_slice());
                let exact = (-h).exp();
                [estimated, end - exact, end + estimated - exact].map(f64::abs)
            });
            let order = |k: usize| (errors[0][k] / errors[1][k]).log2();
            let s = stages as f64;
            // The steps must be long to keep the true error above rounding. At high orders, the measured order
            // therefore deviates by up to a fifth.
            let of_estimate = order(0) / (s + 1.0);
            assert!((of_estimate - 1.0).abs() < 0.2, "s = {s}: {}", order(0));
            let of_truth = order(1) / (2.0 * s);
            assert!((of_truth - 1.0).abs() < 0.2, "s = {s}: {}", order(1));
            let [estimated, truth, embedded] = errors[1];
            // The difference is the true error, which is of higher order.
            assert!((estimated / embedded - 1.0).abs() < 0.01, "{errors:?}");
            let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
            let pade = factorial(stages) * factorial(stages - 1)
                / (factorial(2 * stages - 1) * factorial(2 * stages));
            // Because of the decay within the step, the ratio is 1 − O(h).
            let ratio = truth / (pade * (0.5 * largest).powi(2 * stages as i32));
            assert!((0.1..1.0).contains(&ratio), "s = {s}: {ratio}");
        }
    }
}

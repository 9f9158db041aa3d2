//! The error estimate of a step.

use myovib_dae::{LinearSolver, Problem};

use crate::dense::{add_scaled, start_slope};
use crate::failure::{Failure, Operation};
use crate::newton::{Step, evaluate, norm};
use crate::work::Counters;

/// Workspace of the error estimate.
///
/// The collocation polynomial u fulfils F = 0 at all nodes, but not at t_n. Its defect there,
/// filtered by the real Newton matrix, is the estimate
///
/// ```text
/// err = −(J_y + γ/h J_ẏ)⁻¹ F(t_n, y_n, u'(t_n)),   u'(t_n) = h⁻¹ Σ_j ℓ_j'(0) z_j,
/// ```
///
/// with γ the real eigenvalue of A⁻¹. For M ẏ = f(t, y) this is Hairer & Wanner's (IV.8.19), the
/// difference to an embedded method of order s; in this form it needs no f and no M. It is
/// O(h^(s+1)). In a first step or one that is repeated, a large estimate is filtered again through
/// F(t_n, y_n + err, u'(t_n)): (IV.8.20).
#[derive(Debug)]
pub(crate) struct ErrorTest {
    y_dot: Vec<f64>,
    shifted: Vec<f64>,
    /// The estimate.
    error: Vec<f64>,
    /// 1 for components that count, 0 for those left out.
    mask: Vec<f64>,
}

impl ErrorTest {
    pub(crate) fn new(mask: Vec<f64>) -> Self {
        let n = mask.len();
        Self {
            y_dot: vec![0.0; n],
            shifted: vec![0.0; n],
            error: vec![0.0; n],
            mask,
        }
    }

    /// The weighted norm of the estimated error of the step with increments `z`; not finite if a
    /// solve has overflowed.
    pub(crate) fn estimate<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        z: &[f64],
        filter_twice: bool,
        counters: &mut Counters,
    ) -> Result<f64, Failure> {
        start_slope(step.method, step.h, z, &mut self.y_dot);
        let (t, v) = (step.t, &self.y_dot);
        evaluate(problem, t, step.y, v, &mut self.error, counters)?;
        let norm = self.filter(problem, matrices, step, counters)?;
        if norm < 1.0 || !norm.is_finite() || !filter_twice {
            return Ok(norm);
        }
        self.shifted.copy_from_slice(step.y);
        add_scaled(&mut self.shifted, 1.0, &self.error);
        let (y, v) = (&self.shifted, &self.y_dot);
        evaluate(problem, t, y, v, &mut self.error, counters)?;
        self.filter(problem, matrices, step, counters)
    }

    /// Replaces the defect by the estimate, and returns its norm.
    fn filter<P, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        counters: &mut Counters,
    ) -> Result<f64, Failure> {
        matrices
            .solve_real(problem, &mut self.error)
            .map_err(Operation::LinearSolve.failed())?;
        counters.work.real_solves += 1;
        self.error.iter_mut().for_each(|e| *e = -*e);
        let n = self.error.len();
        Ok(norm((0..n).map(|i| self.error(i) * step.weights[i]), n))
    }

    /// 1 for components that count, 0 for those left out.
    pub(crate) fn mask(&self) -> &[f64] {
        &self.mask
    }

    /// The last estimate for component i, 0 if it is left out.
    pub(crate) fn error(&self, i: usize) -> f64 {
        self.error[i] * self.mask[i]
    }
}

#[cfg(test)]
mod tests {
    use myovib_dae::{Linearization, StepError};
    use myovib_sparse::klu::KluOptions;
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::matrices::KluMatrices;
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

    /// From t = 0 the embedded method, whose quadrature has the order s, leaves out of ∫ t^s what its
    /// defect at 0 is: −Π(0 − c_i) h^s, times h/γ.
    #[test]
    fn the_estimate_is_the_error_of_the_embedded_method() {
        for stages in [1, 3, 5, 7] {
            let method = Method::radau_iia(stages).unwrap();
            let s = stages as i32;
            let mut problem = Power(s);
            let pattern = problem.jacobian_pattern();
            let mut matrices = KluMatrices::new(&pattern, KluOptions::default()).unwrap();
            for h in [0.5, 2.0_f64] {
                let at = Linearization {
                    t: 0.0,
                    y: &[0.0],
                    y_dot: &[0.0],
                    step: h,
                    weights: &[1e6],
                };
                matrices.evaluate(&mut problem, &at).unwrap();
                let gamma = method.real_mode().lambda;
                matrices.set_up(&mut problem, gamma / h, &[]).unwrap();
                let a = DMatrix::from_fn(stages, stages, |i, j| method.a_inverse(i, j));
                let rates = method.nodes().iter().map(|c| h * (c * h).powi(s));
                let rates = DVector::from_iterator(stages, rates);
                let z = a.lu().solve(&rates).unwrap();
                let step = Step {
                    method: &method,
                    t: 0.0,
                    h,
                    y: &[0.0],
                    weights: &[1.0],
                };
                let mut test = ErrorTest::new(vec![1.0]);
                let mut counters = Counters::default();
                test.estimate(
                    &mut problem,
                    &mut matrices,
                    &step,
                    z.as_slice(),
                    false,
                    &mut counters,
                )
                .unwrap();
                let product: f64 = method.nodes().iter().map(|c| -c).product();
                let exact = h.powi(s + 1) * product / gamma;
                // Differences for the Jacobian are right to half the digits.
                let ratio = test.error(0) / exact;
                assert!((ratio - 1.0).abs() < 1e-6, "s = {s}, h = {h}: {ratio}");
            }
        }
    }
}

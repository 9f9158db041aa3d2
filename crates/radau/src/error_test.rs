//! The error estimate of a step.

use myovib_dae::{LinearSolver, Problem};

use crate::dense::add_scaled;
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
        self.y_dot.fill(0.0);
        for (j, z_j) in z.chunks_exact(step.y.len()).enumerate() {
            let slope = step.method.basis_derivative(j, 0.0) / step.h;
            add_scaled(&mut self.y_dot, slope, z_j);
        }
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

    /// The last estimate for component i, 0 if it is left out.
    pub(crate) fn error(&self, i: usize) -> f64 {
        self.error[i] * self.mask[i]
    }
}

//! Quadratures ∫ g(t, y, ẏ) dt, integrated together with the solution.

use std::fmt;

use myovib_dae::checks::expect_vector;
use myovib_dae::{IntegratorError, Problem};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::dense::{Collocation, add_scaled};
use crate::failure::{Failure, Operation};
use crate::method::Method;
use crate::newton::{Step, expect_finite};
use crate::roots::RootFunctions;
use crate::work::Counters;

/// Integrates q̇ = g(t, y, ẏ) with the weights of the method.
///
/// The result is the same as if q were part of the unknowns. Therefore, q has the order of the solution (at most
/// 2s − 1), and dense output is available as for other variables. The increments are h Σ_j a_ij g_j with g at the
/// stages, and the last increment is h Σ_j b_j g_j, so no equations have to be solved.
pub(crate) struct Quadrature<P> {
    rates: Box<RootFunctions<P>>,
    /// Matrix A, row by row.
    a: DMatrix<f64>,
    /// g at the stages of the current step, stage by stage.
    stages: Vec<f64>,
    /// Increments of y in the current step.
    increments: Vec<f64>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    state: QuadratureState,
}

/// State of a quadrature that determines the next steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct QuadratureState {
    q: Vec<f64>,
    /// g at the end of the last step.
    rate: Vec<f64>,
    last: Collocation,
}

impl<P> fmt::Debug for Quadrature<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Quadrature").field("state", &self.state).finish_non_exhaustive()
    }
}

impl<P: Problem> Quadrature<P> {
    /// Creates quadratures for a problem with `n` unknowns. They start at `t0` from `q0`.
    pub(crate) fn new(
        method: &Method,
        (t0, q0): (f64, &[f64]),
        rates: Box<RootFunctions<P>>,
        n: usize,
    ) -> Self {
        let s = method.stages();
        let inverse = DMatrix::from_fn(s, s, |i, j| method.a_inverse(i, j));
        Self {
            rates,
            a: inverse.try_inverse().expect("A is the inverse of A⁻¹"),
            stages: vec![0.0; s * q0.len()],
            increments: vec![0.0; s * n],
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
            state: QuadratureState::at(method, t0, q0),
        }
    }

    pub(crate) fn restart(&mut self, method: &Method, t0: f64, q0: &[f64]) {
        self.state = QuadratureState::at(method, t0, q0);
    }

    pub(crate) fn len(&self) -> usize {
        self.state.q.len()
    }

    /// Evaluates g at the stages of a step, without accepting the step.
    pub(crate) fn evaluate(
        &mut self,
        problem: &mut P,
        step: &Step<'_>,
        increments: impl FnOnce(&mut [f64]),
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let (n, m) = (step.y.len(), self.len());
        increments(&mut self.increments);
        let increments = &self.increments;
        for (i, (c, rates)) in
            (step.method.nodes().iter()).zip(self.stages.chunks_exact_mut(m)).enumerate()
        {
            self.y.copy_from_slice(step.y);
            add_scaled(&mut self.y, 1.0, &increments[i * n..(i + 1) * n]);
            self.y_dot.fill(0.0);
            for (j, z_j) in increments.chunks_exact(n).enumerate() {
                add_scaled(&mut self.y_dot, step.method.a_inverse(i, j) / step.h, z_j);
            }
            counters.statistics.quadrature_evaluations += 1;
            let t = step.t + c * step.h;
            (self.rates)(problem, t, &self.y, &self.y_dot, rates)
                .and_then(|()| expect_finite("quadrature", t, rates))
                .map_err(Operation::Quadrature.failed())?;
        }
        Ok(())
    }

    /// Accepts the step of size `h` from `t0` in which g was evaluated. If `fresh`, the previous step is not used.
    pub(crate) fn accept(&mut self, method: &Method, t0: f64, h: f64, fresh: bool) {
        let m = self.len();
        let QuadratureState { q, rate, last } = &mut self.state;
        (last.t0, last.h) = (t0, h);
        last.y0.copy_from_slice(q);
        last.y_dot0.copy_from_slice(rate);
        for (i, z) in last.increments.chunks_exact_mut(m).enumerate() {
            z.fill(0.0);
            for (j, g) in self.stages.chunks_exact(m).enumerate() {
                add_scaled(z, h * self.a[(i, j)], g);
            }
        }
        if fresh {
            last.free_start(method, 0..m);
        }
        let end = method.stages() - 1;
        add_scaled(q, 1.0, &last.increments[end * m..]);
        rate.copy_from_slice(&self.stages[end * m..]);
    }

    /// Truncates the last step at `t`, where the next step will start.
    pub(crate) fn cut(&mut self, method: &Method, t: f64) {
        let QuadratureState { q, rate, last } = &mut self.state;
        last.evaluate(method, t, 0, q);
        last.evaluate(method, t, 1, rate);
    }

    /// Returns the quadratures of the last step.
    pub(crate) fn last(&self) -> &Collocation {
        &self.state.last
    }

    pub(crate) fn state(&self) -> &QuadratureState {
        &self.state
    }

    pub(crate) fn restore(&mut self, state: &QuadratureState) {
        self.state = state.clone();
    }
}

impl QuadratureState {
    fn at(method: &Method, t0: f64, q0: &[f64]) -> Self {
        let rate = vec![0.0; q0.len()];
        Self { last: Collocation::line(method, t0, q0, &rate), q: q0.to_vec(), rate }
    }

    pub(crate) fn len(&self) -> usize {
        self.q.len()
    }

    /// Validates the lengths and values of a saved state.
    pub(crate) fn validate(&self, stages: usize) -> Result<(), IntegratorError> {
        const WHAT: &str = "quadratures of the state";
        expect_vector(WHAT, self.len(), &self.q)?;
        expect_vector(WHAT, self.len(), &self.rate)?;
        self.last.validate(WHAT, self.len(), stages)
    }
}

//! A body's own solver, continued to the oscillators it drives.
//!
//! The coupling is one-way, so the Newton matrix is block triangular:
//!
//! ```text
//! ⎛ J_b         ⎞ ⎛ δy ⎞   ⎛ b_b ⎞      J_b δy = b_b,
//! ⎝ γ e wᵀ  J_o ⎠ ⎝ δs ⎠ = ⎝ b_o ⎠      J_o δs = b_o − γ e wᵀ δy.
//! ```
//!
//! J_b is solved as if there were no oscillators; each network has small factors of its own.

use myovib_dae::{LinearSolver, Linearization, Problem, StepError};
use myovib_sparse::SparseError;
use myovib_sparse::klu::KluOptions;
use myovib_sparse::pivoting::{Factors, Symbolic};
use num_complex::Complex64;

use super::dae::CoupledDae;
use myovib_sparse::Number;

/// ∂F_o/∂s and ∂F_o/∂ṡ of one network.
#[derive(Debug)]
struct NetworkJacobian {
    of_value: Vec<f64>,
    of_rate: Vec<f64>,
}

/// Room for the Jacobians of all networks of a system.
fn network_jacobians<B: Problem>(dae: &CoupledDae<B>) -> Vec<NetworkJacobian> {
    (0..dae.n_networks())
        .map(|k| {
            let n = dae.oscillators(k).network().jacobian_pattern().nnz();
            NetworkJacobian {
                of_value: vec![0.0; n],
                of_rate: vec![0.0; n],
            }
        })
        .collect()
}

/// Analyses the matrices J_o of all networks.
fn analyses<B: Problem>(
    dae: &CoupledDae<B>,
    options: KluOptions,
) -> Result<Vec<Symbolic>, SparseError> {
    (0..dae.n_networks())
        .map(|k| Symbolic::analyze(dae.oscillators(k).network().jacobian_pattern(), options))
        .collect()
}

/// Evaluates the Jacobians of all networks at the state `y` of the whole system.
fn evaluate_networks<B: Problem>(
    dae: &CoupledDae<B>,
    y: &[f64],
    jacobians: &mut [NetworkJacobian],
) {
    for (k, jacobian) in jacobians.iter_mut().enumerate() {
        let (network, s) = (dae.oscillators(k).network(), &y[dae.range(k)]);
        network.jacobian(s, 1.0, 0.0, &mut jacobian.of_value);
        network.jacobian(s, 0.0, 1.0, &mut jacobian.of_rate);
    }
}

/// The matrices J_o of all networks for one c, factorised.
#[derive(Debug)]
pub(super) struct NetworkFactors<T: Number> {
    networks: Vec<(Vec<T>, Factors<T>)>,
}

impl<T: Number> NetworkFactors<T> {
    fn new(analyses: &[Symbolic]) -> Self {
        let room = |symbolic: &Symbolic| {
            let values = vec![T::zero(); symbolic.nnz()];
            (values, Factors::new(symbolic.clone()))
        };
        Self {
            networks: analyses.iter().map(room).collect(),
        }
    }

    /// Factorises ∂F_o/∂s + c ∂F_o/∂ṡ.
    fn set_up(&mut self, c: T, jacobians: &[NetworkJacobian]) -> Result<(), StepError> {
        for ((values, factors), jacobian) in self.networks.iter_mut().zip(jacobians) {
            let parts = jacobian.of_value.iter().zip(&jacobian.of_rate);
            for (entry, (&value, &rate)) in values.iter_mut().zip(parts) {
                *entry = T::one() * value + c * rate;
            }
            factors.renew(values)?;
        }
        Ok(())
    }

    fn pivot_choices(&self) -> u64 {
        let networks = self.networks.iter();
        networks.map(|(_, factors)| factors.pivot_choices()).sum()
    }

    fn forget_pivots(&mut self) {
        for (_, factors) in &mut self.networks {
            factors.forget_pivots();
        }
    }

    /// Solves with the matrix of network `k` in place.
    pub(super) fn solve_one(&mut self, k: usize, x: &mut [T]) -> Result<(), StepError> {
        self.networks[k].1.solve(x)?;
        Ok(())
    }

    /// Solves for the oscillators in place, the body's part of `x` being solved for.
    fn solve<B: Problem>(&mut self, dae: &CoupledDae<B>, x: &mut [T]) -> Result<(), StepError> {
        let n_body = dae.body_range().len();
        let (body, oscillators) = x.split_at_mut(n_body);
        for (k, (_, factors)) in self.networks.iter_mut().enumerate() {
            let range = dae.range(k);
            let own = &mut oscillators[range.start - n_body..range.end - n_body];
            dae.oscillators(k).subtract_forcing(body, own);
            factors.solve(own)?;
        }
        Ok(())
    }
}

/// Solves the Newton systems of a [`CoupledDae`] by its body's own solver `S`.
///
/// Room for complex matrices is made at the first set-up that asks for them.
#[derive(Debug)]
pub struct CoupledSolver<S> {
    pub(super) body: S,
    jacobians: Vec<NetworkJacobian>,
    analyses: Vec<Symbolic>,
    pub(super) real: NetworkFactors<f64>,
    pub(super) complex: Vec<NetworkFactors<Complex64>>,
}

impl<S> CoupledSolver<S> {
    /// Continues `body` to the oscillators of `dae`.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new<B: Problem>(
        body: S,
        dae: &CoupledDae<B>,
        options: KluOptions,
    ) -> Result<Self, SparseError> {
        let analyses = analyses(dae, options)?;
        Ok(Self {
            body,
            jacobians: network_jacobians(dae),
            real: NetworkFactors::new(&analyses),
            complex: Vec::new(),
            analyses,
        })
    }
}

impl<S> CoupledSolver<S> {
    /// Factorises the matrices of the networks.
    pub(super) fn set_up_networks(
        &mut self,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        self.real.set_up(real, &self.jacobians)?;
        let fresh = || NetworkFactors::new(&self.analyses);
        self.complex.resize_with(complex.len(), fresh);
        let mut matrices = self.complex.iter_mut().zip(complex);
        matrices.try_for_each(|(factors, &c)| factors.set_up(c, &self.jacobians))
    }
}

impl<B: Problem, S: LinearSolver<B>> LinearSolver<CoupledDae<B>> for CoupledSolver<S> {
    fn evaluate(
        &mut self,
        dae: &mut CoupledDae<B>,
        at: &Linearization<'_>,
    ) -> Result<(), StepError> {
        let own = dae.body_range();
        let of_body = Linearization {
            y: &at.y[own.clone()],
            y_dot: &at.y_dot[own.clone()],
            weights: &at.weights[own],
            ..*at
        };
        self.body.evaluate(dae.body_mut(), &of_body)?;
        evaluate_networks(dae, at.y, &mut self.jacobians);
        Ok(())
    }

    fn set_up(
        &mut self,
        dae: &mut CoupledDae<B>,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        self.body.set_up(dae.body_mut(), real, complex)?;
        self.set_up_networks(real, complex)
    }

    fn solve_real(&mut self, dae: &mut CoupledDae<B>, rhs: &mut [f64]) -> Result<(), StepError> {
        let own = dae.body_range();
        self.body.solve_real(dae.body_mut(), &mut rhs[own])?;
        self.real.solve(dae, rhs)
    }

    fn solve_complex(
        &mut self,
        dae: &mut CoupledDae<B>,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        let own = dae.body_range();
        self.body.solve_complex(dae.body_mut(), k, &mut rhs[own])?;
        self.complex[k].solve(dae, rhs)
    }

    fn difference_evaluations(&self) -> u64 {
        self.body.difference_evaluations()
    }

    fn pivot_choices(&self) -> u64 {
        let of_complex: u64 = self.complex.iter().map(NetworkFactors::pivot_choices).sum();
        self.body.pivot_choices() + self.real.pivot_choices() + of_complex
    }

    fn forget_pivots(&mut self) {
        self.body.forget_pivots();
        self.real.forget_pivots();
        let complex = self.complex.iter_mut();
        complex.for_each(NetworkFactors::forget_pivots);
    }

    fn history(&self) -> Vec<bool> {
        self.body.history()
    }

    fn set_history(&mut self, history: &[bool]) -> Result<(), StepError> {
        self.body.set_history(history)
    }
}

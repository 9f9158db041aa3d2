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

use myovib_dae::{Problem, StepError, StructuredSolver};
use myovib_radau::{Method, NewtonMatrices};
use myovib_sparse::klu::{Factors, KluError, KluOptions, Symbolic};
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
) -> Result<Vec<Symbolic>, KluError> {
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
struct NetworkFactors<T: Number> {
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

    /// Solves for the oscillators in place, the body's part of `x` being solved for.
    fn solve<B: Problem>(&self, dae: &CoupledDae<B>, x: &mut [T]) -> Result<(), StepError> {
        let n_body = dae.body_range().len();
        let (body, oscillators) = x.split_at_mut(n_body);
        for (k, (_, factors)) in self.networks.iter().enumerate() {
            let range = dae.range(k);
            let own = &mut oscillators[range.start - n_body..range.end - n_body];
            dae.oscillators(k).subtract_forcing(body, own);
            factors.solve(own)?;
        }
        Ok(())
    }
}

/// Solves the Newton systems of a [`CoupledDae`] by its body's own solver `S`, for IDAS.
#[derive(Debug)]
pub struct CoupledSolver<S> {
    body: S,
    jacobians: Vec<NetworkJacobian>,
    factors: NetworkFactors<f64>,
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
    ) -> Result<Self, KluError> {
        Ok(Self {
            body,
            jacobians: network_jacobians(dae),
            factors: NetworkFactors::new(&analyses(dae, options)?),
        })
    }
}

impl<B: Problem, S: StructuredSolver<B>> StructuredSolver<CoupledDae<B>> for CoupledSolver<S> {
    fn setup(
        &mut self,
        dae: &mut CoupledDae<B>,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        c_j: f64,
    ) -> Result<(), StepError> {
        let own = dae.body_range();
        self.body
            .setup(dae.body_mut(), t, &y[own.clone()], &y_dot[own], c_j)?;
        evaluate_networks(dae, y, &mut self.jacobians);
        self.factors.set_up(c_j, &self.jacobians)
    }

    fn solve(&mut self, dae: &mut CoupledDae<B>, rhs: &mut [f64]) -> Result<(), StepError> {
        let own = dae.body_range();
        self.body.solve(dae.body_mut(), &mut rhs[own])?;
        self.factors.solve(dae, rhs)
    }
}

/// Solves the Newton systems of a [`CoupledDae`] by its body's own matrices `M`, for Radau IIA.
#[derive(Debug)]
pub struct CoupledMatrices<M> {
    body: M,
    jacobians: Vec<NetworkJacobian>,
    real: NetworkFactors<f64>,
    complex: Vec<NetworkFactors<Complex64>>,
}

impl<M> CoupledMatrices<M> {
    /// Continues `body` to the oscillators of `dae`.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new<B: Problem>(
        body: M,
        dae: &CoupledDae<B>,
        options: KluOptions,
        method: &Method,
    ) -> Result<Self, KluError> {
        let modes = method.complex_modes().iter();
        let analyses = analyses(dae, options)?;
        Ok(Self {
            body,
            jacobians: network_jacobians(dae),
            real: NetworkFactors::new(&analyses),
            complex: modes.map(|_| NetworkFactors::new(&analyses)).collect(),
        })
    }
}

impl<B: Problem, M: NewtonMatrices<B>> NewtonMatrices<CoupledDae<B>> for CoupledMatrices<M> {
    fn evaluate(
        &mut self,
        dae: &mut CoupledDae<B>,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<(), StepError> {
        let own = dae.body_range();
        self.body
            .evaluate(dae.body_mut(), t, &y[own.clone()], &y_dot[own])?;
        evaluate_networks(dae, y, &mut self.jacobians);
        Ok(())
    }

    fn set_up(
        &mut self,
        dae: &mut CoupledDae<B>,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        self.body.set_up(dae.body_mut(), real, complex)?;
        self.real.set_up(real, &self.jacobians)?;
        let mut matrices = self.complex.iter_mut().zip(complex);
        matrices.try_for_each(|(factors, &c)| factors.set_up(c, &self.jacobians))
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
}

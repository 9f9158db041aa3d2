//! Extends a body's linear solver to the oscillators it drives.
//!
//! The coupling is one-way, so the Newton matrix is block triangular:
//!
//! ```text
//! ⎛ J_b         ⎞ ⎛ δy ⎞   ⎛ b_b ⎞      J_b δy = b_b,
//! ⎝ γ e wᵀ  J_o ⎠ ⎝ δs ⎠ = ⎝ b_o ⎠      J_o δs = b_o − γ e wᵀ δy.
//! ```
//!
//! J_b is solved independently of the oscillators. Each network has a small separate factorization.

use myovib_dae::{LinearSolver, Linearization, Problem, StepError, columns};
use myovib_sparse::SparseOptions;
use myovib_sparse::{Scalar, SparseError};
use num_complex::Complex64;

use super::dae::CoupledDae;
use super::networks::{NetworkMatrix, Networks};

/// Solves the Newton systems of a [`CoupledDae`] with the solver `S` of its body.
///
/// Complex matrices are allocated at the first complex matrix setup.
#[derive(Debug)]
pub struct CoupledSolver<S> {
    pub(super) body: S,
    networks: Networks,
    pub(super) real: Vec<NetworkMatrix<f64>>,
    pub(super) complex: Vec<Vec<NetworkMatrix<Complex64>>>,
}

impl<S> CoupledSolver<S> {
    /// Extends `body` to the oscillators of `dae`.
    pub fn new<B: Problem>(
        body: S,
        dae: &CoupledDae<B>,
        options: SparseOptions,
    ) -> Result<Self, SparseError> {
        let networks = Networks::new(dae, options)?;
        Ok(Self { body, real: networks.matrices(), complex: Vec::new(), networks })
    }
}

impl<S> CoupledSolver<S> {
    /// Factorizes the matrices of the networks.
    pub(super) fn set_up_networks<B: Problem>(
        &mut self,
        dae: &CoupledDae<B>,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        let networks = &self.networks;
        networks.set_up(dae, real, &mut self.real)?;
        self.complex.resize_with(complex.len(), || networks.matrices());
        let mut matrices = self.complex.iter_mut().zip(complex);
        matrices.try_for_each(|(matrices, &c)| networks.set_up(dae, c, matrices))
    }
}

/// Solves for the oscillators in place. The part of `x` that belongs to the body must already contain the solution.
fn solve_networks<B: Problem, T: Scalar>(
    dae: &CoupledDae<B>,
    matrices: &mut [NetworkMatrix<T>],
    x: &mut [T],
) -> Result<(), StepError> {
    let n_body = dae.body_range().len();
    let (body, oscillators) = x.split_at_mut(n_body);
    for (k, matrix) in matrices.iter_mut().enumerate() {
        let range = dae.range(k);
        let own = &mut oscillators[range.start - n_body..range.end - n_body];
        dae.oscillators(k).subtract_forcing(body, own);
        matrix.solve(own)?;
    }
    Ok(())
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
        self.networks.linearize(dae, at.y);
        Ok(())
    }

    fn set_up(
        &mut self,
        dae: &mut CoupledDae<B>,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        self.body.set_up(dae.body_mut(), real, complex)?;
        self.set_up_networks(dae, real, complex)
    }

    fn solve_real(&mut self, dae: &mut CoupledDae<B>, rhs: &mut [f64]) -> Result<(), StepError> {
        let own = dae.body_range();
        self.body.solve_real(dae.body_mut(), &mut rhs[own])?;
        solve_networks(dae, &mut self.real, rhs)
    }

    fn solve_complex(
        &mut self,
        dae: &mut CoupledDae<B>,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        let own = dae.body_range();
        self.body.solve_complex(dae.body_mut(), k, &mut rhs[own])?;
        solve_networks(dae, &mut self.complex[k], rhs)
    }

    fn solve_real_columns(
        &mut self,
        dae: &mut CoupledDae<B>,
        rhs: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let own = ..n_columns * dae.body_range().len();
        let body = dae.body_mut();
        self.body.solve_real_columns(body, &mut rhs[own], n_columns)?;
        columns::one_by_one(rhs, n_columns, |column| solve_networks(dae, &mut self.real, column))
    }

    fn solve_complex_columns(
        &mut self,
        dae: &mut CoupledDae<B>,
        k: usize,
        rhs: &mut [Complex64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let own = ..n_columns * dae.body_range().len();
        let body = dae.body_mut();
        self.body.solve_complex_columns(body, k, &mut rhs[own], n_columns)?;
        columns::one_by_one(rhs, n_columns, |column| {
            solve_networks(dae, &mut self.complex[k], column)
        })
    }

    fn difference_evaluations(&self) -> u64 {
        self.body.difference_evaluations()
    }

    fn pivot_choices(&self) -> u64 {
        let of_real = self.real.iter().map(|own| own.factors.pivot_choices());
        let of_complex = self.complex.iter().flatten();
        let of_complex = of_complex.map(|own| own.factors.pivot_choices());
        self.body.pivot_choices() + of_real.chain(of_complex).sum::<u64>()
    }

    fn forget_pivots(&mut self) {
        self.body.forget_pivots();
        let real = self.real.iter_mut();
        real.for_each(|own| own.factors.forget_pivots());
        let complex = self.complex.iter_mut().flatten();
        complex.for_each(|own| own.factors.forget_pivots());
    }

    fn history(&self) -> Vec<bool> {
        self.body.history()
    }

    fn set_history(&mut self, history: &[bool]) -> Result<(), StepError> {
        self.body.set_history(history)
    }
}

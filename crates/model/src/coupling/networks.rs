//! Newton matrices of oscillator networks from which the velocities are eliminated.
//!
//! With the stiffness K and the diagonal d of the damping, the systems before and after the elimination are
//!
//! ```text
//! ⎛ c   −I    ⎞ ⎛ δy ⎞   ⎛ b_y ⎞     (K + c (c + d)) δy = b_w + (c + d) b_y,
//! ⎝ K   c + d ⎠ ⎝ δw ⎠ = ⎝ b_w ⎠     δw = c δy − b_y.
//! ```

use myovib_dae::{Problem, StepError};
use myovib_sparse::SparseOptions;
use myovib_sparse::pivoting::{Factors, Symbolic};
use myovib_sparse::{Scalar, SparseError};

use super::dae::CoupledDae;
use super::oscillators::Oscillators;

/// K and d of one network and the symbolic analysis of its Newton matrix.
#[derive(Debug)]
struct NetworkTangent {
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    analysis: Symbolic,
}

/// K and d of all networks of a system.
#[derive(Debug)]
pub(super) struct Networks(Vec<NetworkTangent>);

impl Networks {
    /// Analyzes the matrices of the networks of `dae`.
    pub(super) fn new<B: Problem>(
        dae: &CoupledDae<B>,
        options: SparseOptions,
    ) -> Result<Self, SparseError> {
        let linearized = |k| {
            let network = dae.oscillators(k).network();
            let pattern = network.stiffness_pattern();
            Ok(NetworkTangent {
                stiffness: vec![0.0; pattern.nnz()],
                damping: vec![0.0; network.n_oscillators()],
                analysis: Symbolic::analyze(pattern, options)?,
            })
        };
        let networks = (0..dae.n_networks()).map(linearized);
        networks.collect::<Result<_, _>>().map(Self)
    }

    /// Linearizes all networks at the state `y` of the coupled system.
    pub(super) fn linearize<B: Problem>(&mut self, dae: &CoupledDae<B>, y: &[f64]) {
        for (k, own) in self.0.iter_mut().enumerate() {
            let network = dae.oscillators(k).network();
            network.linearize(&y[dae.range(k)], &mut own.stiffness, &mut own.damping);
        }
    }

    /// Allocates the matrices for one value of c.
    pub(super) fn matrices<T: Scalar>(&self) -> Vec<NetworkMatrix<T>> {
        self.0.iter().map(NetworkMatrix::new).collect()
    }

    /// Factorizes the matrices of all networks for the value `c`.
    pub(super) fn set_up<B: Problem, T: Scalar>(
        &self,
        dae: &CoupledDae<B>,
        c: T,
        matrices: &mut [NetworkMatrix<T>],
    ) -> Result<(), StepError> {
        let mut networks = self.0.iter().zip(matrices).enumerate();
        networks.try_for_each(|(k, (own, matrix))| matrix.set_up(dae.oscillators(k), own, c))
    }
}

/// Factorized matrix of one network for one value of c.
#[derive(Debug)]
pub(super) struct NetworkMatrix<T: Scalar> {
    c: T,
    /// c + d.
    rates: Vec<T>,
    /// K + c (c + d).
    values: Vec<T>,
    pub(super) factors: Factors<T>,
}

impl<T: Scalar> NetworkMatrix<T> {
    fn new(of: &NetworkTangent) -> Self {
        Self {
            c: T::zero(),
            rates: vec![T::zero(); of.damping.len()],
            values: vec![T::zero(); of.stiffness.len()],
            factors: Factors::new(of.analysis.clone()),
        }
    }

    fn set_up(&mut self, of: &Oscillators, at: &NetworkTangent, c: T) -> Result<(), StepError> {
        self.c = c;
        for (value, &stiffness) in self.values.iter_mut().zip(&at.stiffness) {
            *value = T::one() * stiffness;
        }
        let damping = self.rates.iter_mut().zip(&at.damping);
        for ((rate, &d), entry) in damping.zip(of.network().stiffness_diagonal()) {
            *rate = c + T::one() * d;
            self.values[entry] += c * *rate;
        }
        self.factors.renew(&self.values)?;
        Ok(())
    }

    /// Solves in place for the states of the network.
    pub(super) fn solve(&mut self, x: &mut [T]) -> Result<(), StepError> {
        let (of_position, of_velocity) = x.split_at_mut(self.rates.len());
        let right = of_velocity.iter_mut().zip(&*of_position);
        for ((w, &y), &rate) in right.zip(&self.rates) {
            *w += rate * y;
        }
        self.factors.solve(of_velocity)?;
        for (y, w) in of_position.iter_mut().zip(of_velocity) {
            (*y, *w) = (*w, self.c * *w - *y);
        }
        Ok(())
    }
}

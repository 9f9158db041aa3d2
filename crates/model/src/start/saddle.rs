//! Direct solution of (H, -Bᵀ; B, 0): a symmetric matrix with a constraint.

use myovib_sparse::klu::KluOptions;
use myovib_sparse::pivoting::{Factors, Symbolic};
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::error::ModelError;

/// The factors of (H, -Bᵀ; B, 0).
pub(crate) struct Saddle {
    n: usize,
    factors: Factors<f64>,
}

impl Saddle {
    /// Factorises; a B without rows leaves H alone.
    pub(crate) fn factor(h: &CscMatrix<f64>, b: &CscMatrix<f64>) -> Result<Self, ModelError> {
        let (n, m) = (h.nrows(), b.nrows());
        let mut matrix = CooMatrix::new(n + m, n + m);
        for (row, column, value) in h.triplet_iter() {
            matrix.push(row, column, *value);
        }
        for (row, column, value) in b.triplet_iter() {
            matrix.push(n + row, column, *value);
            matrix.push(column, n + row, -value);
        }
        let matrix = CscMatrix::from(&matrix);
        let symbolic = Symbolic::analyze(matrix.pattern(), KluOptions::default())?;
        let mut factors = Factors::new(symbolic);
        factors.renew(matrix.values())?;
        Ok(Self { n, factors })
    }

    /// (w, π) with H w - Bᵀπ = `force`, B w = `flux`.
    pub(crate) fn solve(
        &mut self,
        force: &[f64],
        flux: &[f64],
    ) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
        let mut w = [force, flux].concat();
        self.factors.solve(&mut w)?;
        let multipliers = w.split_off(self.n);
        Ok((w, multipliers))
    }
}

//! Direct solution of linear systems with (H, -Bᵀ; B, 0): a symmetric matrix with a constraint.

use std::sync::Arc;

use myovib_sparse::SparseOptions;
use myovib_sparse::{Elimination, Kind, LinearWork, SparseSystem, Structure};
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::error::ModelError;

/// Factors of (H, -Bᵀ; -B, 0), which is symmetric.
pub(crate) struct Saddle {
    n: usize,
    factors: SparseSystem<f64>,
    work: LinearWork,
}

impl Saddle {
    /// Factorizes H without a constraint. If the analysis of an earlier matrix with the same pattern is `known`, it is
    /// used again.
    pub(crate) fn alone(
        h: &CscMatrix<f64>,
        known: &mut Option<Arc<Elimination>>,
    ) -> Result<Self, ModelError> {
        Self::analyzed(h, &CscMatrix::zeros(0, h.nrows()), known)
    }

    /// Factorizes the matrix. H must be symmetric.
    pub(crate) fn factor(h: &CscMatrix<f64>, b: &CscMatrix<f64>) -> Result<Self, ModelError> {
        Self::analyzed(h, b, &mut None)
    }

    fn analyzed(
        h: &CscMatrix<f64>,
        b: &CscMatrix<f64>,
        known: &mut Option<Arc<Elimination>>,
    ) -> Result<Self, ModelError> {
        let (n, m) = (h.nrows(), b.nrows());
        let mut matrix = CooMatrix::new(n + m, n + m);
        // A mass matrix does not couple different components. Without its zeros, it separates into several small
        // systems.
        for (row, column, value) in h.triplet_iter().filter(|(.., value)| **value != 0.0) {
            matrix.push(row, column, *value);
        }
        for (row, column, value) in b.triplet_iter() {
            matrix.push(n + row, column, -value);
            matrix.push(column, n + row, -value);
        }
        let matrix = CscMatrix::from(&matrix);
        let structure = Structure { kind: Kind::Symmetric, constraints: n..n + m };
        let elimination = match known {
            Some(known) => known,
            none => {
                let options = SparseOptions::default();
                none.insert(Arc::new(Elimination::new(matrix.pattern(), structure, options)?))
            }
        };
        elimination.expect_memory()?;
        let mut factors = SparseSystem::new(elimination.clone());
        factors.values_mut().copy_from_slice(matrix.values());
        let mut work = LinearWork::default();
        factors.renew(&mut work)?;
        Ok(Self { n, factors, work })
    }

    /// Solves H w - Bᵀπ = `force`, B w = `flux` for (w, π).
    pub(crate) fn solve(
        &mut self,
        force: &[f64],
        flux: &[f64],
    ) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
        let mut w = force.to_vec();
        w.extend(flux.iter().map(|flux| -flux));
        self.factors.solve(&mut w, &mut self.work)?;
        let multipliers = w.split_off(self.n);
        Ok((w, multipliers))
    }
}

//! Mass matrices of displacement and pressure, constant in time.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::element::{inverse_map, p2_values};
use crate::quadrature::TriangleRule;
use crate::space::{Degree, Space};
use crate::sparsity::{node_pattern, place, pressure_pattern};

/// A symmetric sparse matrix; rows and columns may be read either way.
#[derive(Debug, Clone)]
pub(crate) struct Symmetric {
    pub(crate) pattern: SparsityPattern,
    pub(crate) values: Vec<f64>,
}

impl Symmetric {
    /// ρ ∫ φ_a φ_b over all displacement nodes. The integrand has degree 4, the rule's.
    pub(crate) fn node_mass(space: &Space, density: f64) -> Self {
        let pattern = node_pattern(space);
        match space.degree() {
            Degree::One => Self::assemble(space, pattern, density, |lambda| lambda.to_vec()),
            Degree::Two => Self::assemble(space, pattern, density, |l| p2_values(l).to_vec()),
        }
    }

    /// ∫ ψ_k ψ_l over the vertices.
    pub(crate) fn pressure_mass(space: &Space) -> Self {
        Self::assemble(space, pressure_pattern(space), 1.0, |lambda| {
            lambda.to_vec()
        })
    }

    fn assemble(
        space: &Space,
        pattern: SparsityPattern,
        density: f64,
        shape: impl Fn([f64; 3]) -> Vec<f64>,
    ) -> Self {
        let mut values = vec![0.0; pattern.nnz()];
        for element in 0..space.n_elements() {
            let (_, det) = inverse_map(space.mesh().corners(element));
            for q in TriangleRule::Degree4.points() {
                let shapes = shape(q.barycentric);
                let weight = 0.5 * det * q.weight * density;
                for (&a, phi_a) in space.element_nodes(element).iter().zip(&shapes) {
                    for (&b, phi_b) in space.element_nodes(element).iter().zip(&shapes) {
                        values[place(&pattern, a, b)] += weight * phi_a * phi_b;
                    }
                }
            }
        }
        Self { pattern, values }
    }

    fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.pattern.major_offsets()[row]..self.pattern.major_offsets()[row + 1];
        self.pattern.minor_indices()[range.clone()]
            .iter()
            .copied()
            .zip(self.values[range].iter().copied())
    }

    /// out = self x.
    pub(crate) fn apply(&self, x: &[f64], out: &mut [f64]) {
        assert_eq!(
            (x.len(), out.len()),
            (self.pattern.minor_dim(), self.pattern.major_dim())
        );
        for (row, out) in out.iter_mut().enumerate() {
            *out = self.row(row).map(|(column, value)| value * x[column]).sum();
        }
    }

    /// The same on both components of interleaved vectors.
    pub(crate) fn apply_interleaved(&self, x: &[f64], out: &mut [f64]) {
        let n = self.pattern.major_dim();
        assert_eq!((x.len(), out.len()), (2 * n, 2 * n));
        for (row, out) in out.chunks_exact_mut(2).enumerate() {
            let mut sum = [0.0; 2];
            for (column, value) in self.row(row) {
                sum[0] += value * x[2 * column];
                sum[1] += value * x[2 * column + 1];
            }
            out.copy_from_slice(&sum);
        }
    }

    /// The sum of each row: ∫ ψ_k for the pressure's mass matrix.
    pub(crate) fn row_sums(&self) -> Vec<f64> {
        (0..self.pattern.major_dim())
            .map(|row| self.row(row).map(|(_, v)| v).sum())
            .collect()
    }
}

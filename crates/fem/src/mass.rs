//! Mass matrices of displacement and pressure, and the H1 norm of displacements; constant in time.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::element::{inverse_map, p1_gradients, p2_gradients, p2_values};
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
    /// ∫ ρ φ_a φ_b over all displacement nodes, ρ by triangle. The integrand has degree 4, the
    /// rule's.
    pub(crate) fn node_mass(space: &Space, densities: &[f64]) -> Self {
        let pattern = node_pattern(space);
        let density = |element: usize| densities[element];
        match space.degree() {
            Degree::One => Self::assemble(space, pattern, density, |lambda| lambda.to_vec()),
            Degree::Two => Self::assemble(space, pattern, density, |l| p2_values(l).to_vec()),
        }
    }

    /// ∫ ∇φ_a · ∇φ_b over all displacement nodes. The integrand has degree 2 at most.
    pub(crate) fn node_gradients(space: &Space) -> Self {
        let pattern = node_pattern(space);
        match space.degree() {
            Degree::One => Self::assemble_gradients(space, pattern, |_| p1_gradients().to_vec()),
            Degree::Two => Self::assemble_gradients(space, pattern, |l| p2_gradients(l).to_vec()),
        }
    }

    fn assemble_gradients(
        space: &Space,
        pattern: SparsityPattern,
        reference: impl Fn([f64; 3]) -> Vec<[f64; 2]>,
    ) -> Self {
        let mut values = vec![0.0; pattern.nnz()];
        for element in 0..space.n_elements() {
            let (inverse, det) = inverse_map(space.mesh().corners(element));
            for q in TriangleRule::Degree2.points() {
                let gradients: Vec<[f64; 2]> = reference(q.barycentric)
                    .into_iter()
                    .map(|[xi, eta]| [0, 1].map(|m| xi * inverse[0][m] + eta * inverse[1][m]))
                    .collect();
                let weight = 0.5 * det * q.weight;
                for (&a, grad_a) in space.element_nodes(element).iter().zip(&gradients) {
                    for (&b, grad_b) in space.element_nodes(element).iter().zip(&gradients) {
                        let product = grad_a[0] * grad_b[0] + grad_a[1] * grad_b[1];
                        values[place(&pattern, a, b)] += weight * product;
                    }
                }
            }
        }
        Self { pattern, values }
    }

    /// ∫ ψ_k ψ_l over the vertices.
    pub(crate) fn pressure_mass(space: &Space) -> Self {
        Self::assemble(
            space,
            pressure_pattern(space),
            |_| 1.0,
            |lambda| lambda.to_vec(),
        )
    }

    fn assemble(
        space: &Space,
        pattern: SparsityPattern,
        density: impl Fn(usize) -> f64,
        shape: impl Fn([f64; 3]) -> Vec<f64>,
    ) -> Self {
        let mut values = vec![0.0; pattern.nnz()];
        for element in 0..space.n_elements() {
            let (_, det) = inverse_map(space.mesh().corners(element));
            for q in TriangleRule::Degree4.points() {
                let shapes = shape(q.barycentric);
                let weight = 0.5 * det * q.weight * density(element);
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
        let (x, out) = (x.as_chunks::<2>().0, out.as_chunks_mut::<2>().0);
        for (row, out) in out.iter_mut().enumerate() {
            let mut sum = [0.0; 2];
            for (column, value) in self.row(row) {
                let [x, y] = x[column];
                sum[0] += value * x;
                sum[1] += value * y;
            }
            *out = sum;
        }
    }

    /// The sum of each row: ∫ ψ_k for the pressure's mass matrix.
    pub(crate) fn row_sums(&self) -> Vec<f64> {
        (0..self.pattern.major_dim())
            .map(|row| self.row(row).map(|(_, v)| v).sum())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::rectangle;

    /// ∫ |∇f|² on the unit square for f = x + 2y (linear and quadratic elements) and f = x² + xy.
    #[test]
    fn the_h1_norm_of_polynomials() {
        let mesh = rectangle([0.0, 0.0], [1.0, 1.0], [3, 2]).unwrap();
        let norm_squared = |space: &Space, f: &dyn Fn(f64, f64) -> f64| {
            let values: Vec<f64> = space.node_points().iter().map(|&[x, y]| f(x, y)).collect();
            let mut image = vec![0.0; values.len()];
            Symmetric::node_gradients(space).apply(&values, &mut image);
            values.iter().zip(&image).map(|(v, i)| v * i).sum::<f64>()
        };
        let close = |found: f64, exact: f64| assert!((found - exact).abs() < 1e-13 * exact);
        for space in [Space::equal_order(&mesh), Space::taylor_hood(&mesh)] {
            close(norm_squared(&space, &|x, y| x + 2.0 * y), 5.0);
        }
        // (2x + y)² + x² integrates to 4/3 + 1 + 1/3 + 1/3.
        close(
            norm_squared(&Space::taylor_hood(&mesh), &|x, y| x * x + x * y),
            3.0,
        );
    }
}

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
        let shapes = |_: usize, lambda: [f64; 3]| match space.degree() {
            Degree::One => lambda.to_vec(),
            Degree::Two => p2_values(lambda).to_vec(),
        };
        let rule = TriangleRule::Degree4;
        Self::assemble(
            space,
            node_pattern(space),
            rule,
            shapes,
            |element, w, a, b| w * densities[element] * a * b,
        )
    }

    /// ∫ ∇φ_a · ∇φ_b over all displacement nodes. The integrand has degree 2 at most.
    pub(crate) fn node_gradients(space: &Space) -> Self {
        let gradients = |element: usize, lambda: [f64; 3]| -> Vec<[f64; 2]> {
            let (inverse, _) = inverse_map(space.mesh().corners(element));
            let reference = match space.degree() {
                Degree::One => p1_gradients().to_vec(),
                Degree::Two => p2_gradients(lambda).to_vec(),
            };
            let physical = reference
                .iter()
                .map(|[xi, eta]| [0, 1].map(|m| xi * inverse[0][m] + eta * inverse[1][m]));
            physical.collect()
        };
        let rule = TriangleRule::Degree2;
        Self::assemble(space, node_pattern(space), rule, gradients, |_, w, a, b| {
            w * (a[0] * b[0] + a[1] * b[1])
        })
    }

    /// ∫ ψ_k ψ_l over the vertices.
    pub(crate) fn pressure_mass(space: &Space) -> Self {
        let shapes = |_: usize, lambda: [f64; 3]| lambda.to_vec();
        let rule = TriangleRule::Degree4;
        Self::assemble(
            space,
            pressure_pattern(space),
            rule,
            shapes,
            |_, w, a, b| w * a * b,
        )
    }

    /// Σ over elements and quadrature points of `product(element, weight, s_a, s_b)`, with `shapes`
    /// (element, barycentric coordinates) ↦ s_1, s_2, …: one value or gradient per node, in the
    /// order of the element's nodes.
    fn assemble<T>(
        space: &Space,
        pattern: SparsityPattern,
        rule: TriangleRule,
        shapes: impl Fn(usize, [f64; 3]) -> Vec<T>,
        product: impl Fn(usize, f64, &T, &T) -> f64,
    ) -> Self {
        let points = rule.points();
        let mut values = vec![0.0; pattern.nnz()];
        for element in 0..space.n_elements() {
            let nodes = space.element_nodes(element);
            let area = space.mesh().area_of(element);
            for q in &points {
                let (shapes, weight) = (shapes(element, q.barycentric), area * q.weight);
                for (&a, shape_a) in nodes.iter().zip(&shapes) {
                    for (&b, shape_b) in nodes.iter().zip(&shapes) {
                        values[place(&pattern, a, b)] += product(element, weight, shape_a, shape_b);
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

//! Constant matrices: mass matrices of displacement and pressure, and the H1 seminorm of displacements.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::element::quadrature::Rule;
use crate::space::Space;
use crate::space::sparsity::{Members, entry_index, pattern_of};

/// Symmetric sparse matrix, in which rows and columns are interchangeable.
#[derive(Debug, Clone)]
pub(crate) struct SymmetricMatrix {
    pub(crate) pattern: SparsityPattern,
    pub(crate) values: Vec<f64>,
}

impl SymmetricMatrix {
    /// Returns ∫ ρ φ_a φ_b over all displacement nodes, with one density per element. On straight elements, the
    /// integrand has degree at most 4.
    pub(crate) fn node_mass(space: &Space, densities: &[f64]) -> Self {
        let shape = space.mesh().shape();
        Self::assemble(
            space,
            (space.n_nodes(), Space::element_nodes),
            Rule::Degree4,
            |_, lambda| shape.values(space.degree(), lambda),
            |element, w, a, b| w * densities[element] * a * b,
        )
    }

    /// Returns ∫ ∇φ_a · ∇φ_b over all displacement nodes. On straight elements, the integrand has degree at
    /// most 2.
    pub(crate) fn node_gradients(space: &Space) -> Self {
        in_dimension!(space.dimension(), |D| {
            let gradients = |element: usize, lambda: &[f64]| -> Vec<[f64; D]> {
                let (inverse, _) = space.map_at::<D>(element, lambda);
                let reference = space.mesh().shape().gradients::<D>(space.degree(), lambda);
                let physical = reference.iter().map(|gradient| {
                    std::array::from_fn(|j| (0..D).map(|m| gradient[m] * inverse[m][j]).sum())
                });
                physical.collect()
            };
            Self::assemble(
                space,
                (space.n_nodes(), Space::element_nodes),
                Rule::Degree2,
                gradients,
                |_, w, a, b| w * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>(),
            )
        })
    }

    /// Returns the matrix ∫ w ψ_k ψ_l of the pressures, with one weight w per element.
    pub(crate) fn pressure_mass(space: &Space, weight: impl Fn(usize) -> f64) -> Self {
        Self::assemble(
            space,
            (space.n_pressures(), Space::element_pressures),
            Rule::Degree4,
            |_, lambda| lambda.to_vec(),
            |element, w, a, b| w * weight(element) * a * b,
        )
    }

    /// Sums `product(element, weight, s_a, s_b)` over elements and quadrature points. The function `shapes` maps
    /// (element, barycentric coordinates) to s_1, s_2, …, which are one value or gradient for each of the
    /// `n` nodes or pressures that are `members` of the element.
    fn assemble<T>(
        space: &Space,
        (n, members): (usize, Members),
        rule: Rule,
        shapes: impl Fn(usize, &[f64]) -> Vec<T>,
        product: impl Fn(usize, f64, &T, &T) -> f64,
    ) -> Self {
        let pattern = pattern_of(space, n, members);
        // The map of a curved element contributes a determinant of degree 2 or 3.
        let curved = (0..space.n_elements()).any(|element| space.is_curved(element));
        let rule = if curved { Rule::Degree6 } else { rule };
        let points = rule.points(space.mesh().shape());
        let mut values = vec![0.0; pattern.nnz()];
        for element in 0..space.n_elements() {
            let members = members(space, element);
            let straight = space.mesh().measure_of(element);
            for q in &points {
                let measure = match space.is_curved(element) {
                    true => space.measure_at(element, &q.barycentric),
                    false => straight,
                };
                let (shapes, weight) = (shapes(element, &q.barycentric), measure * q.weight);
                for (&a, shape_a) in members.iter().zip(&shapes) {
                    for (&b, shape_b) in members.iter().zip(&shapes) {
                        values[entry_index(&pattern, a, b)] +=
                            product(element, weight, shape_a, shape_b);
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

    /// Writes the product with `x` to `out`.
    pub(crate) fn apply(&self, x: &[f64], out: &mut [f64]) {
        assert_eq!((x.len(), out.len()), (self.pattern.minor_dim(), self.pattern.major_dim()));
        for (row, out) in out.iter_mut().enumerate() {
            *out = self.row(row).map(|(column, value)| value * x[column]).sum();
        }
    }

    /// Multiplies the matrix by each component of an interleaved vector, and writes the result to `out`.
    pub(crate) fn apply_interleaved(&self, dimension: usize, x: &[f64], out: &mut [f64]) {
        let n = dimension * self.pattern.major_dim();
        assert_eq!((x.len(), out.len()), (n, n));
        in_dimension!(dimension, |D| {
            let (x, out) = (x.as_chunks::<D>().0, out.as_chunks_mut::<D>().0);
            for (row, out) in out.iter_mut().enumerate() {
                let mut sum = [0.0; D];
                for (column, value) in self.row(row) {
                    for (sum, x) in sum.iter_mut().zip(&x[column]) {
                        *sum += value * x;
                    }
                }
                *out = sum;
            }
        })
    }

    /// Returns the sum of each row. For the pressure mass matrix, this is ∫ ψ_k.
    pub(crate) fn row_sums(&self) -> Vec<f64> {
        (0..self.pattern.major_dim()).map(|row| self.row(row).map(|(_, v)| v).sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::rectangle;

    /// Checks ∫ |∇f|² on the unit square for f = x + 2y (linear and quadratic elements) and
    /// f = x² + xy.
    #[test]
    fn h1_seminorm_of_polynomials_is_exact() {
        let mesh = rectangle([0.0, 0.0], [1.0, 1.0], [3, 2]).unwrap();
        let norm_squared = |space: &Space, f: &dyn Fn(f64, f64) -> f64| {
            let values: Vec<f64> = space.node_points().iter().map(|&[x, y]| f(x, y)).collect();
            let mut image = vec![0.0; values.len()];
            SymmetricMatrix::node_gradients(space).apply(&values, &mut image);
            values.iter().zip(&image).map(|(v, i)| v * i).sum::<f64>()
        };
        let close = |found: f64, exact: f64| assert!((found - exact).abs() < 1e-13 * exact);
        for space in [Space::equal_order(&mesh), Space::taylor_hood(&mesh)] {
            close(norm_squared(&space, &|x, y| x + 2.0 * y), 5.0);
        }
        // The integrand (2x + y)² + x² has the integral 4/3 + 1 + 1/3 + 1/3.
        close(norm_squared(&Space::taylor_hood(&mesh), &|x, y| x * x + x * y), 3.0);
    }
}

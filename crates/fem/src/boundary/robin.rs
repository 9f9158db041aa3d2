//! Elastic and viscous support of a boundary (Robin condition), in all directions or along the
//! normal.

use std::collections::BTreeMap;

use crate::boundary::facet::{cross, facet_measure, facet_points, is_curved};
use crate::error::FemError;
use crate::solid::Solid;
use crate::space::Space;
use crate::space::sparsity::entry_index;

/// Directions in which a Robin support acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SupportDirection {
    /// All directions.
    All,
    /// Normal of the undeformed boundary.
    Normal,
}

/// Matrix R with `v·R u = ∫_group v·u ds` or `∫_group (v·N) (u·N) ds`. A boundary with the Robin
/// condition `P N + k u + c u̇ = 0` has the stiffness k R and the damping c R.
///
/// # Shapes
/// Displacements and forces have length `n_components`.
///
/// # Units
/// R in m², in 2D in m. With k in Pa/m and c in Pa·s/m forces are in N, in 2D in N/m.
#[derive(Debug, Clone)]
pub struct RobinMatrix {
    /// Row, column and value over all components, sorted by row.
    entries: Vec<(usize, usize, f64)>,
}

impl RobinMatrix {
    /// Creates the matrix for a group of edges of triangles or faces of tetrahedra.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], or [`FemError::WrongGroup`] for other groups.
    pub fn new(space: &Space, group: &str, direction: SupportDirection) -> Result<Self, FemError> {
        match space.dimension() {
            2 => Self::new_in::<2>(space, group, direction),
            _ => Self::new_in::<3>(space, group, direction),
        }
    }

    fn new_in<const D: usize>(
        space: &Space,
        group: &str,
        direction: SupportDirection,
    ) -> Result<Self, FemError> {
        let points = space.node_points::<D>();
        let rule = facet_points(space.mesh().shape(), space.degree());
        let mut sums: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for facet in space.mesh().facets(group)? {
            let nodes = space.facet_nodes(facet);
            let positions: Vec<[f64; D]> = nodes.iter().map(|&node| points[node]).collect();
            let curved = is_curved(&positions);
            let straight = facet_measure(&positions[..D]);
            for q in &rule {
                let measure = if curved {
                    q.measure(&positions)
                } else {
                    straight
                };
                let projection = match direction {
                    SupportDirection::All => identity(),
                    SupportDirection::Normal => {
                        let normal = unit_normal(&q.slopes, &positions);
                        normal.map(|n| normal.map(|m| n * m))
                    }
                };
                for (&a, of_a) in nodes.iter().zip(&q.values) {
                    for (&b, of_b) in nodes.iter().zip(&q.values) {
                        let mass = measure * q.weight * of_a * of_b;
                        for (i, row) in projection.iter().enumerate() {
                            for (k, entry) in row.iter().enumerate().filter(|(_, e)| **e != 0.0) {
                                *sums.entry((D * a + i, D * b + k)).or_default() += mass * entry;
                            }
                        }
                    }
                }
            }
        }
        let entries = sums
            .into_iter()
            .map(|((row, column), value)| (row, column, value));
        Ok(Self {
            entries: entries.collect(),
        })
    }

    /// Adds `factor` R `u` to `total`.
    ///
    /// # Panics
    /// Panics if an array is too short.
    pub fn add_product(&self, factor: f64, u: &[f64], total: &mut [f64]) {
        for &(row, column, value) in &self.entries {
            total[row] += factor * value * u[column];
        }
    }

    /// Returns u·R u, twice the energy of the support for k = 1.
    ///
    /// # Panics
    /// Panics if `u` is too short.
    pub fn square(&self, u: &[f64]) -> f64 {
        let terms = self.entries.iter();
        terms
            .map(|&(row, column, value)| value * u[row] * u[column])
            .sum()
    }

    /// Adds the entries of `factor` R between free components of `solid` to `values`.
    ///
    /// # Shapes
    /// `values` holds the entries of [`Solid::displacement_pattern`].
    ///
    /// # Panics
    /// Panics if the matrix belongs to another space or `values` is too short.
    pub fn add_values(&self, factor: f64, solid: &Solid, values: &mut [f64]) {
        let free = solid.dofs().full_to_free();
        let (pattern, n_free) = (solid.displacement_pattern(), solid.dofs().n_free());
        for &(row, column, value) in &self.entries {
            let [row, column] = [row, column].map(|full| free[full] as usize);
            // Constrained components are mapped to an index above `n_free`.
            if row < n_free && column < n_free {
                values[entry_index(pattern, row, column)] += factor * value;
            }
        }
    }

    /// Returns the row, column and value of each entry over all components.
    pub fn entries(&self) -> &[(usize, usize, f64)] {
        &self.entries
    }
}

fn identity<const D: usize>() -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|k| if i == k { 1.0 } else { 0.0 }))
}

/// Returns a unit normal of a facet with nodes at `positions`, of either orientation.
fn unit_normal<const D: usize>(slopes: &[Vec<f64>], positions: &[[f64; D]]) -> [f64; D] {
    let mut tangents = [[0.0; 3]; 2];
    for (tangent, slopes) in tangents.iter_mut().zip(slopes) {
        for (slope, position) in slopes.iter().zip(positions) {
            for (tangent, x) in tangent.iter_mut().zip(position) {
                *tangent += slope * x;
            }
        }
    }
    let [s, t] = tangents;
    let normal = match D {
        2 => [s[1], -s[0], 0.0],
        _ => cross(s, t),
    };
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    std::array::from_fn(|i| normal[i] / length)
}

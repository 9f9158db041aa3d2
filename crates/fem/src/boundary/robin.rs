//! Elastic and viscous support of a boundary (Robin condition), either in all directions or along the normal.

use std::collections::BTreeMap;

use crate::boundary::facet::for_each_point;
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

/// Matrix R defined by `v·R u = ∫_group v·u ds` or `∫_group (v·N) (u·N) ds`. A boundary with the Robin condition
/// `P N + k u + c u̇ = 0` has the stiffness k R and the damping c R.
///
/// # Shapes
/// Displacements and forces have length `n_components`.
///
/// # Units
/// R is in m² (m in 2D). With k in Pa/m and c in Pa·s/m, forces are in N (N/m in 2D).
#[derive(Debug, Clone)]
pub struct RobinMatrix {
    /// Row, column and value of each entry over all components, sorted by row.
    entries: Vec<(usize, usize, f64)>,
}

impl RobinMatrix {
    /// Creates the matrix for a group of edges of triangles or faces of tetrahedra.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] if its members
    /// are of another kind.
    pub fn new(space: &Space, group: &str, direction: SupportDirection) -> Result<Self, FemError> {
        in_dimension!(space.dimension(), |D| {
            let mut sums: BTreeMap<(usize, usize), f64> = BTreeMap::new();
            for_each_point::<D>(space, group, |at| {
                let projection = match direction {
                    SupportDirection::All => identity(),
                    SupportDirection::Normal => {
                        let normal = at.unit_normal();
                        normal.map(|n| normal.map(|m| n * m))
                    }
                };
                for (&a, shape_a) in at.nodes.iter().zip(&at.point.values) {
                    for (&b, shape_b) in at.nodes.iter().zip(&at.point.values) {
                        let mass = at.weight * shape_a * shape_b;
                        for (i, row) in projection.iter().enumerate() {
                            for (k, entry) in row.iter().enumerate().filter(|(_, e)| **e != 0.0) {
                                *sums.entry((D * a + i, D * b + k)).or_default() += mass * entry;
                            }
                        }
                    }
                }
            })?;
            let entries = sums.into_iter().map(|((row, column), value)| (row, column, value));
            Ok(Self { entries: entries.collect() })
        })
    }

    /// Creates the matrix of a spring at a point: `v·R u = v(x)·u(x)` or `(v(x)·d) (u(x)·d)`. Here, u(x) is the
    /// sum of nodal values with the given weights, and d is a unit vector.
    pub fn of_point(
        space: &Space,
        node_weights: &[(usize, f64)],
        direction: Option<[f64; 3]>,
    ) -> Self {
        let n = space.dimension();
        let projection = |i: usize, k: usize| match direction {
            None => f64::from(u8::from(i == k)),
            Some(d) => d[i] * d[k],
        };
        let mut entries = Vec::new();
        for (a, weight_a) in node_weights {
            for (b, weight_b) in node_weights {
                for (i, k) in (0..n * n).map(|ik| (ik / n, ik % n)) {
                    let value = weight_a * weight_b * projection(i, k);
                    if value != 0.0 {
                        entries.push((n * a + i, n * b + k, value));
                    }
                }
            }
        }
        entries.sort_by_key(|&(row, column, _)| (row, column));
        Self { entries }
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

    /// Returns u·R u, which is twice the energy of the support for k = 1.
    ///
    /// # Panics
    /// Panics if `u` is too short.
    pub fn square(&self, u: &[f64]) -> f64 {
        let terms = self.entries.iter();
        terms.map(|&(row, column, value)| value * u[row] * u[column]).sum()
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
            // The index of constrained components is above `n_free`.
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

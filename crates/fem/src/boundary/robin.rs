//! Elastic and viscous support of a boundary, by the displacement itself or along the normal.

use std::collections::BTreeMap;

use crate::boundary::facet::{cross, facet_measure, facet_points, is_curved};
use crate::error::FemError;
use crate::solid::Solid;
use crate::space::Space;
use crate::space::sparsity::place;

/// Along what a boundary is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Along {
    /// In all directions.
    All,
    /// Along the normal of the undeformed boundary.
    Normal,
}

/// R with `v·R u = ∫_group v·u ds`, or `∫_group (v·N) (u·N) ds`: k R and c R are stiffness and
/// damping of a boundary on which `P N + k u + c u̇ = 0` (Robin's condition).
///
/// # Shapes
/// Displacements and forces: `n_components`.
///
/// # Units
/// m², in the plane m: with k in Pa/m and c in Pa·s/m forces in N, in the plane in N/m.
#[derive(Debug, Clone)]
pub struct Robin {
    /// Row, column, value over all components, by rows.
    entries: Vec<(usize, usize, f64)>,
}

impl Robin {
    /// The operator for a group of edges of triangles or faces of tetrahedra.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], or [`FemError::WrongGroup`] for other groups.
    pub fn new(space: &Space, group: &str, along: Along) -> Result<Self, FemError> {
        match space.dimension() {
            2 => Self::new_in::<2>(space, group, along),
            _ => Self::new_in::<3>(space, group, along),
        }
    }

    fn new_in<const D: usize>(space: &Space, group: &str, along: Along) -> Result<Self, FemError> {
        let points = space.node_points::<D>();
        let rule = facet_points(space.mesh().shape(), space.degree());
        let mut sums: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for facet in space.mesh().facets(group)? {
            let nodes = space.facet_nodes(facet);
            let places: Vec<[f64; D]> = nodes.iter().map(|&node| points[node]).collect();
            let curved = is_curved(&places);
            let straight = facet_measure(&places[..D]);
            for q in &rule {
                let measure = if curved { q.measure(&places) } else { straight };
                let held = match along {
                    Along::All => identity(),
                    Along::Normal => {
                        let normal = normal(&q.slopes, &places);
                        normal.map(|n| normal.map(|m| n * m))
                    }
                };
                for (&a, of_a) in nodes.iter().zip(&q.values) {
                    for (&b, of_b) in nodes.iter().zip(&q.values) {
                        let mass = measure * q.weight * of_a * of_b;
                        for (i, row) in held.iter().enumerate() {
                            for (k, held) in row.iter().enumerate().filter(|(_, h)| **h != 0.0) {
                                *sums.entry((D * a + i, D * b + k)).or_default() += mass * held;
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

    /// `total` += `factor` R `u`.
    ///
    /// # Panics
    /// If an array is too short.
    pub fn add_product(&self, factor: f64, u: &[f64], total: &mut [f64]) {
        for &(row, column, value) in &self.entries {
            total[row] += factor * value * u[column];
        }
    }

    /// u·R u, twice the energy for k = 1.
    ///
    /// # Panics
    /// If `u` is too short.
    pub fn square(&self, u: &[f64]) -> f64 {
        let terms = self.entries.iter();
        terms
            .map(|&(row, column, value)| value * u[row] * u[column])
            .sum()
    }

    /// `values` += `factor` R between free components of `solid`.
    ///
    /// # Shapes
    /// `values`: the entries of [`Solid::displacement_pattern`].
    ///
    /// # Panics
    /// If the operator is not one of the solid's space, or `values` too short.
    pub fn add_values(&self, factor: f64, solid: &Solid, values: &mut [f64]) {
        let free = solid.dofs().full_to_free();
        let (pattern, n_free) = (solid.displacement_pattern(), solid.dofs().n_free());
        for &(row, column, value) in &self.entries {
            let [row, column] = [row, column].map(|full| free[full] as usize);
            // A constrained component has a number beyond all.
            if row < n_free && column < n_free {
                values[place(pattern, row, column)] += factor * value;
            }
        }
    }

    /// Row and column of each entry over all components, and the value.
    pub fn entries(&self) -> &[(usize, usize, f64)] {
        &self.entries
    }
}

fn identity<const D: usize>() -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|k| if i == k { 1.0 } else { 0.0 }))
}

/// The unit normal of a facet with nodes at `places`, to either side.
fn normal<const D: usize>(slopes: &[Vec<f64>], places: &[[f64; D]]) -> [f64; D] {
    let mut tangents = [[0.0; 3]; 2];
    for (tangent, slopes) in tangents.iter_mut().zip(slopes) {
        for (slope, place) in slopes.iter().zip(places) {
            for (tangent, x) in tangent.iter_mut().zip(place) {
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

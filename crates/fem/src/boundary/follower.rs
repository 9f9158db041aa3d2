//! Pressure on the deformed boundary: a load that turns and stretches with it.

use crate::boundary::deformed::{DeformedFacets, normal};
use crate::boundary::facet::outward;
use crate::error::FemError;
use crate::solid::Solid;
use crate::space::dofs::CONSTRAINED;
use crate::space::sparsity::place;

/// −∫_group p (cof F N)·φ ds for a pressure p on the deformed group, positive towards the body.
///
/// cof F N ds is the deformed boundary's normal times its length or area, x' ds turned by −90° or
/// x_s × x_t ds dt. So the load is a polynomial of the positions of degree one less than the
/// dimension, integrated exactly.
///
/// # Shapes
/// Loads and displacements: `n_components`.
///
/// # Units
/// p in Pa, the load in N; in the plane in N/m.
#[derive(Debug, Clone)]
pub struct FollowerPressure {
    boundary: DeformedFacets,
    /// Places in the displacement pattern of each facet, by row (node, component) and column.
    places: Vec<Vec<Option<u32>>>,
}

impl FollowerPressure {
    /// The operator for a group of the boundary: edges of triangles, faces of tetrahedra.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], [`FemError::WrongGroup`] if the group holds something else,
    /// [`FemError::InnerFacet`] for a member with the body on both sides.
    pub fn new(solid: &Solid, group: &str) -> Result<Self, FemError> {
        let space = solid.space();
        let dimension = space.dimension();
        let boundary = DeformedFacets::new(space, &outward(space, group)?);
        let free = solid.dofs().full_to_free();
        let pattern = solid.displacement_pattern();
        let places = boundary.facets.iter().map(|nodes| {
            let components = || {
                let of_node = |&node: &usize| dimension * node..dimension * (node + 1);
                nodes.iter().flat_map(of_node)
            };
            let entries =
                components().flat_map(|row| components().map(move |column| (row, column)));
            let place = |(row, column): (usize, usize)| {
                let both_free = free[row] != CONSTRAINED && free[column] != CONSTRAINED;
                both_free.then(|| {
                    let place = place(pattern, free[row] as usize, free[column] as usize);
                    u32::try_from(place).expect("fewer than 2^32 matrix entries")
                })
            };
            entries.map(place).collect()
        });
        Ok(Self {
            places: places.collect(),
            boundary,
        })
    }

    /// `total` += the load of `pressure` at the displacement `u`.
    ///
    /// # Panics
    /// If an array is too short.
    pub fn add_force(&self, pressure: f64, u: &[f64], total: &mut [f64]) {
        match self.boundary.dimension {
            2 => self.add_force_in::<2>(pressure, u, total),
            _ => self.add_force_in::<3>(pressure, u, total),
        }
    }

    fn add_force_in<const D: usize>(&self, pressure: f64, u: &[f64], total: &mut [f64]) {
        for nodes in &self.boundary.facets {
            for point in &self.boundary.points {
                let [s, t] = self.boundary.tangents::<D>(nodes, point, u);
                let normal = normal::<D>(s, t);
                for (&node, value) in nodes.iter().zip(&point.values) {
                    let factor = -pressure * point.weight * value;
                    for (total, normal) in total[D * node..].iter_mut().zip(normal) {
                        *total += factor * normal;
                    }
                }
            }
        }
    }

    /// `values` += the derivative of the load by the free components of u, at `u`.
    ///
    /// # Shapes
    /// `values`: the entries of [`Solid::displacement_pattern`].
    ///
    /// # Panics
    /// If an array is too short.
    pub fn add_stiffness(&self, pressure: f64, u: &[f64], values: &mut [f64]) {
        match self.boundary.dimension {
            2 => self.add_stiffness_in::<2>(pressure, u, values),
            _ => self.add_stiffness_in::<3>(pressure, u, values),
        }
    }

    fn add_stiffness_in<const D: usize>(&self, pressure: f64, u: &[f64], values: &mut [f64]) {
        for (nodes, places) in self.boundary.facets.iter().zip(&self.places) {
            let n_columns = D * nodes.len();
            for point in &self.boundary.points {
                let [s, t] = self.boundary.tangents::<D>(nodes, point, u);
                for b in 0..nodes.len() {
                    for k in 0..D {
                        // The derivative of the normal by component k of node b.
                        let mut along = [0.0; D];
                        along[k] = point.slopes[0][b];
                        let mut change = normal::<D>(along, t);
                        if D == 3 {
                            along[k] = point.slopes[1][b];
                            let second = normal::<D>(s, along);
                            for (change, second) in change.iter_mut().zip(second) {
                                *change += second;
                            }
                        }
                        for (a, value) in point.values.iter().take(nodes.len()).enumerate() {
                            let factor = -pressure * point.weight * value;
                            for (i, change) in change.iter().enumerate() {
                                let place = places[(D * a + i) * n_columns + D * b + k];
                                if let Some(place) = place {
                                    values[place as usize] += factor * change;
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

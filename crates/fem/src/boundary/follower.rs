//! Pressure on the deformed boundary (follower load).

use crate::boundary::SurfaceOperator;
use crate::boundary::deformed::DeformedFacets;
use crate::boundary::facet::area_vector;
use crate::error::FemError;
use crate::solid::Solid;

/// Load −∫_group p (cof F N)·φ ds of a pressure p on the deformed group. A positive pressure acts toward the body.
///
/// The deformed area vector cof F N ds is x' ds rotated by −90° in 2D, and x_s × x_t ds dt in 3D. The load is
/// therefore a polynomial of degree D − 1 in the positions and is integrated exactly.
///
/// # Shapes
/// Loads and displacements have length `n_components`.
///
/// # Units
/// p is in Pa; the load is in N (N/m in 2D).
#[derive(Debug, Clone)]
pub struct FollowerPressure {
    boundary: DeformedFacets,
    /// Indices of matrix entries as in [`DeformedFacets::matrix_indices`].
    indices: Vec<Vec<Option<u32>>>,
}

impl FollowerPressure {
    /// Creates the operator for a boundary group, which consists of edges of triangles or faces of tetrahedra.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, [`FemError::WrongGroup`] if its members are
    /// of another kind, or [`FemError::InteriorFacet`] if a member has elements on both sides.
    pub fn new(solid: &Solid, group: &str) -> Result<Self, FemError> {
        let boundary = DeformedFacets::of_group(solid.space(), group)?;
        Ok(Self { indices: boundary.matrix_indices(solid), boundary })
    }
}

impl SurfaceOperator for FollowerPressure {
    fn add_force(&self, pressure: f64, u: &[f64], total: &mut [f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            let facets = &self.boundary.facets;
            self.boundary.for_each_point::<D>(u, |facet, point, [s, t]| {
                let normal = area_vector(s, t);
                for (&node, value) in facets[facet].iter().zip(&point.values) {
                    let factor = -pressure * point.weight * value;
                    for (total, normal) in total[D * node..].iter_mut().zip(normal) {
                        *total += factor * normal;
                    }
                }
            });
        })
    }

    fn add_stiffness(&self, pressure: f64, u: &[f64], values: &mut [f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            let facets = &self.boundary.facets;
            self.boundary.for_each_point::<D>(u, |facet, point, [s, t]| {
                let (n, indices) = (facets[facet].len(), &self.indices[facet]);
                for b in 0..n {
                    for k in 0..D {
                        // Derivative of the area vector with respect to component k of node b.
                        let mut tangent = [0.0; D];
                        tangent[k] = point.slopes[0][b];
                        let mut change = area_vector::<D>(tangent, t);
                        if D == 3 {
                            tangent[k] = point.slopes[1][b];
                            let second = area_vector::<D>(s, tangent);
                            for (change, second) in change.iter_mut().zip(second) {
                                *change += second;
                            }
                        }
                        for (a, value) in point.values.iter().take(n).enumerate() {
                            let factor = -pressure * point.weight * value;
                            for (i, change) in change.iter().enumerate() {
                                let index = indices[(D * a + i) * D * n + D * b + k];
                                if let Some(index) = index {
                                    values[index as usize] += factor * change;
                                }
                            }
                        }
                    }
                }
            });
        })
    }
}

//! Boundary facets in the deformed configuration.

use crate::boundary::facet::{FacetPoint, facet_points, outward_facets};
use crate::element::Shape;
use crate::error::FemError;
use crate::solid::Solid;
use crate::space::Space;
use crate::space::dofs::CONSTRAINED;
use crate::space::sparsity::entry_index;

/// Facets of a group with quadrature in the deformed configuration.
///
/// In 2D, the boundary is a curve x(s) that runs counterclockwise around the body. The outward normal times the
/// length element is the tangent x' ds rotated by −90°. In 3D, the boundary is a surface x(s, t), and the outward
/// normal times the area element is x_s × x_t ds dt.
#[derive(Debug, Clone)]
pub struct DeformedFacets {
    /// Dimension of the space.
    pub dimension: usize,
    /// Quadrature points of the reference facet. The weights include the measure of the reference facet.
    pub points: Vec<FacetPoint>,
    /// Nodes of each facet.
    pub facets: Vec<Vec<usize>>,
    /// Reference positions of all nodes.
    pub coordinates: Vec<f64>,
}

impl DeformedFacets {
    /// Creates the facets of a boundary group, which are edges of triangles or faces of tetrahedra.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, [`FemError::WrongGroup`] if its members are
    /// of another kind, or [`FemError::InteriorFacet`] if a member has elements on both sides.
    pub fn of_group(space: &Space, group: &str) -> Result<Self, FemError> {
        Ok(Self::new(space, &outward_facets(space, group)?))
    }

    /// Creates the facets from their vertices, which are ordered such that the normals point outward.
    pub(crate) fn new(space: &Space, outward: &[Vec<usize>]) -> Self {
        let shape: &Shape = space.mesh().shape();
        let mut points = facet_points(shape, space.degree());
        for point in &mut points {
            // The reference edge has length 1, and the reference face has area 1/2.
            point.weight *= if shape.dimension == 2 { 1.0 } else { 0.5 };
        }
        Self {
            dimension: shape.dimension,
            points,
            facets: outward.iter().map(|facet| space.facet_nodes(facet)).collect(),
            coordinates: space.coordinates().to_vec(),
        }
    }

    /// Returns the indices of each facet's entries in the displacement pattern, by row (node, component) and
    /// column. The index is `None` for constrained components.
    pub fn matrix_indices(&self, solid: &Solid) -> Vec<Vec<Option<u32>>> {
        let dimension = self.dimension;
        let free = solid.dofs().full_to_free();
        let pattern = solid.displacement_pattern();
        let indices = self.facets.iter().map(|nodes| {
            let components = || {
                let of_node = |&node: &usize| dimension * node..dimension * (node + 1);
                nodes.iter().flat_map(of_node)
            };
            let entries =
                components().flat_map(|row| components().map(move |column| (row, column)));
            let index = |(row, column): (usize, usize)| {
                let both_free = free[row] != CONSTRAINED && free[column] != CONSTRAINED;
                both_free.then(|| {
                    let index = entry_index(pattern, free[row] as usize, free[column] as usize);
                    u32::try_from(index).expect("fewer than 2^32 matrix entries")
                })
            };
            entries.map(index).collect()
        });
        indices.collect()
    }

    /// Returns Σ factor · (position of the node at displacement `u`). If the factors are values of shape
    /// functions, this is the position of a point. If they are derivatives of shape functions, it is a tangent.
    pub(crate) fn sum<const D: usize>(
        &self,
        nodes: &[usize],
        factors: &[f64],
        u: &[f64],
    ) -> [f64; D] {
        let mut sum = [0.0; D];
        for (&node, factor) in nodes.iter().zip(factors) {
            for (i, entry) in sum.iter_mut().enumerate() {
                *entry += factor * (self.coordinates[D * node + i] + u[D * node + i]);
            }
        }
        sum
    }

    /// Returns the derivatives of the position with respect to the facet parameters. In 2D, only the first
    /// derivative is nonzero.
    pub(crate) fn tangents<const D: usize>(
        &self,
        nodes: &[usize],
        point: &FacetPoint,
        u: &[f64],
    ) -> [[f64; D]; 2] {
        let mut tangents = [[0.0; D]; 2];
        for (tangent, slopes) in tangents.iter_mut().zip(&point.slopes) {
            *tangent = self.sum(nodes, slopes, u);
        }
        tangents
    }

    /// Calls `kernel` at each quadrature point. The arguments are the index of the facet, the point, and the
    /// derivatives of the position at displacement `u` with respect to the facet parameters. In 2D, only the first
    /// derivative is nonzero.
    ///
    /// # Panics
    /// Panics if `u` is too short, or unless `D` is the dimension.
    pub fn for_each_point<const D: usize>(
        &self,
        u: &[f64],
        mut kernel: impl FnMut(usize, &FacetPoint, [[f64; D]; 2]),
    ) {
        for (facet, nodes) in self.facets.iter().enumerate() {
            for point in &self.points {
                kernel(facet, point, self.tangents(nodes, point, u));
            }
        }
    }
}

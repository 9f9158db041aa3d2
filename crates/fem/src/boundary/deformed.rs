//! Boundary facets in the deformed configuration.

use crate::boundary::facet::{FacetPoint, cross, facet_points};
use crate::element::Shape;
use crate::space::Space;

/// Facets of a group with quadrature in the deformed configuration.
///
/// In 2D the boundary is a curve x(s), counterclockwise around the body; its outward normal times
/// ds is the tangent x' ds rotated by −90°. In 3D it is a surface x(s, t), and the outward normal
/// times the area element is x_s × x_t ds dt.
#[derive(Debug, Clone)]
pub(crate) struct DeformedFacets {
    pub(crate) dimension: usize,
    /// Quadrature points of the reference facet; weights include its measure.
    pub(crate) points: Vec<FacetPoint>,
    /// Nodes of each facet.
    pub(crate) facets: Vec<Vec<usize>>,
    /// Reference positions of all nodes.
    pub(crate) coordinates: Vec<f64>,
}

impl DeformedFacets {
    /// Creates the facets from their vertices, ordered so that the normals point outward.
    pub(crate) fn new(space: &Space, outward: &[Vec<usize>]) -> Self {
        let shape: &Shape = space.mesh().shape();
        let mut points = facet_points(shape, space.degree());
        for point in &mut points {
            // The reference edge has length 1, the reference face area 1/2.
            point.weight *= if shape.dimension == 2 { 1.0 } else { 0.5 };
        }
        Self {
            dimension: shape.dimension,
            points,
            facets: outward
                .iter()
                .map(|facet| space.facet_nodes(facet))
                .collect(),
            coordinates: space.coordinates().to_vec(),
        }
    }

    /// Returns Σ factor · (position of the node at displacement `u`). With shape function values as
    /// factors this is the position of a point, with their derivatives it is a tangent.
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

    /// Returns the derivatives of the position with respect to the facet parameters; in 2D only the
    /// first is nonzero.
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
}

/// Returns the area vector: in 2D the first tangent rotated by −90°, in 3D the cross product of
/// both.
pub(crate) fn area_vector<const D: usize>(s: [f64; D], t: [f64; D]) -> [f64; D] {
    let mut normal = [0.0; D];
    match D {
        2 => normal.copy_from_slice(&[s[1], -s[0]]),
        _ => normal.copy_from_slice(&cross([s[0], s[1], s[2]], [t[0], t[1], t[2]])),
    }
    normal
}

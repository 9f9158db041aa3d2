//! A group of the boundary as it is deformed.

use crate::boundary::facet::{FacetPoint, cross, facet_points};
use crate::element::Shape;
use crate::space::Space;

/// The facets of a group, with quadrature on them where displacements put them.
///
/// With the boundary as a curve x(s), counter-clockwise around the body, its outward normal times ds
/// is its tangent x' ds turned by −90°; as a surface x(s, t) seen from outside it is x_s × x_t ds dt.
#[derive(Debug, Clone)]
pub(crate) struct DeformedFacets {
    pub(crate) dimension: usize,
    /// Quadrature points of the reference facet, weights times its measure.
    pub(crate) points: Vec<FacetPoint>,
    /// The nodes of each facet.
    pub(crate) facets: Vec<Vec<usize>>,
    /// Positions at rest of all nodes.
    pub(crate) coordinates: Vec<f64>,
}

impl DeformedFacets {
    /// Facets by their vertices, in the order that makes their normals point outwards.
    pub(crate) fn new(space: &Space, outward: &[Vec<usize>]) -> Self {
        let shape: &Shape = space.mesh().shape();
        let mut points = facet_points(shape, space.degree());
        for point in &mut points {
            // An edge's parameter runs over a length of 1, a face's over a triangle of area 1/2.
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

    /// Σ factor · (position of the node at the displacement `u`): the position at a point, by the values of its
    /// shape functions, and its derivatives, by their slopes.
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

    /// The derivatives of the position by the facet's parameters; an edge has only the first.
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

/// The first tangent turned by −90° in the plane, the product of both in space.
pub(crate) fn normal<const D: usize>(s: [f64; D], t: [f64; D]) -> [f64; D] {
    let mut normal = [0.0; D];
    match D {
        2 => normal.copy_from_slice(&[s[1], -s[0]]),
        _ => normal.copy_from_slice(&cross([s[0], s[1], s[2]], [t[0], t[1], t[2]])),
    }
    normal
}

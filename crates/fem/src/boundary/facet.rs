//! Quadrature on boundary facets, which are edges of triangles or faces of tetrahedra.

use std::collections::HashMap;

use crate::element::quadrature::{Rule, edge_degree5};
use crate::element::{Barycentric, Shape, TRIANGLE};
use crate::error::FemError;
use crate::mesh::simplices::cross;
use crate::mesh::{Group, Mesh, distance};
use crate::space::{Degree, ElementPoint, Space};

/// Quadrature point of the reference facet.
#[derive(Debug, Clone)]
pub struct FacetPoint {
    /// Weight as a fraction of the facet measure.
    pub weight: f64,
    /// Barycentric coordinates.
    pub barycentric: Vec<f64>,
    /// Values of the shape functions of the facet nodes.
    pub values: Vec<f64>,
    /// Derivatives of the shape functions along the edges that start at the first vertex. An edge has one
    /// derivative, a face has two.
    pub slopes: Vec<Vec<f64>>,
}

impl FacetPoint {
    /// Returns the area vector at this point of a facet, given the positions of the facet's nodes.
    fn area_vector<const D: usize>(&self, positions: &[[f64; D]]) -> [f64; D] {
        let mut tangents = [[0.0; D]; 2];
        for (tangent, slopes) in tangents.iter_mut().zip(&self.slopes) {
            for (slope, position) in slopes.iter().zip(positions) {
                for (tangent, x) in tangent.iter_mut().zip(position) {
                    *tangent += slope * x;
                }
            }
        }
        let [s, t] = tangents;
        area_vector(s, t)
    }

    /// Returns the local measure at this point of a curved facet, given the positions of the facet's nodes.
    fn measure<const D: usize>(&self, positions: &[[f64; D]]) -> f64 {
        // The reference edge has length 1, and the reference face has area 1/2.
        let reference = if D == 2 { 1.0 } else { 0.5 };
        reference * length(self.area_vector(positions))
    }
}

fn length<const D: usize>(vector: [f64; D]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns whether the facet is curved. In a curved facet, a node is not at the midpoint of its edge.
fn is_curved<const D: usize>(positions: &[[f64; D]]) -> bool {
    let edges: &[[usize; 2]] = match D {
        2 => &[[0, 1]],
        _ => TRIANGLE.edges,
    };
    let midpoint =
        |&[a, b]: &[usize; 2]| std::array::from_fn(|m| 0.5 * (positions[a][m] + positions[b][m]));
    let nodes = positions.iter().skip(D);
    nodes.zip(edges).any(|(node, edge)| *node != midpoint(edge))
}

/// Quadrature point on a facet of the undeformed boundary.
pub(crate) struct SurfacePoint<'a, const D: usize> {
    pub(crate) facet: &'a [usize],
    pub(crate) nodes: &'a [usize],
    pub(crate) positions: &'a [[f64; D]],
    pub(crate) point: &'a FacetPoint,
    /// Quadrature weight, including the local measure.
    pub(crate) weight: f64,
    is_curved: bool,
}

impl<const D: usize> SurfacePoint<'_, D> {
    pub(crate) fn position(&self) -> [f64; D] {
        let weights = match self.is_curved {
            true => &self.point.values,
            false => &self.point.barycentric,
        };
        std::array::from_fn(|j| {
            let terms = weights.iter().zip(self.positions);
            terms.map(|(weight, x)| weight * x[j]).sum()
        })
    }

    /// Returns a unit normal, with either orientation.
    pub(crate) fn unit_normal(&self) -> [f64; D] {
        let normal = self.point.area_vector(self.positions);
        let length = length(normal);
        normal.map(|n| n / length)
    }
}

/// Calls `kernel` at the quadrature points of all facets of a boundary group.
///
/// # Errors
/// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] if its members are
/// of another kind.
pub(crate) fn for_each_point<const D: usize>(
    space: &Space,
    group: &str,
    mut kernel: impl FnMut(&SurfacePoint<'_, D>),
) -> Result<(), FemError> {
    let points = space.node_points::<D>();
    let rule = facet_points(space.mesh().shape(), space.degree());
    for facet in space.mesh().facets(group)? {
        let nodes = space.facet_nodes(facet);
        let positions: Vec<[f64; D]> = nodes.iter().map(|&node| points[node]).collect();
        let is_curved = is_curved(&positions);
        let straight = facet_measure(&positions[..D]);
        for point in &rule {
            let measure = match is_curved {
                true => point.measure(&positions),
                false => straight,
            };
            kernel(&SurfacePoint {
                facet,
                nodes: &nodes,
                positions: &positions,
                point,
                weight: measure * point.weight,
                is_curved,
            });
        }
    }
    Ok(())
}

/// Returns the quadrature points of facets. The rules are exact up to degree 5 on edges and degree 6 on faces.
pub(crate) fn facet_points(shape: &Shape, degree: Degree) -> Vec<FacetPoint> {
    if shape.dimension == 2 {
        let at = |(s, weight): (f64, f64)| FacetPoint {
            weight,
            barycentric: vec![1.0 - s, s],
            values: edge_values(degree, s).to_vec(),
            slopes: vec![edge_slopes(degree, s).to_vec()],
        };
        return edge_degree5().map(at).to_vec();
    }
    let points = Rule::Degree6.points(&TRIANGLE);
    let at = points.iter().map(|q| {
        let gradients = TRIANGLE.gradients::<2>(degree, &q.barycentric);
        FacetPoint {
            weight: q.weight,
            barycentric: q.barycentric.to_vec(),
            values: TRIANGLE.values(degree, &q.barycentric),
            slopes: (0..2)
                .map(|m| gradients.iter().map(|gradient| gradient[m]).collect())
                .collect(),
        }
    });
    at.collect()
}

/// Returns the values of the shape functions of the ends and the midpoint of an edge at the parameter `s` in [0,
/// 1].
fn edge_values(degree: Degree, s: f64) -> [f64; 3] {
    match degree {
        Degree::One => [1.0 - s, s, 0.0],
        Degree::Two => {
            let lambda = [1.0 - s, s];
            let [start, end] = lambda.map(|l| l * (2.0 * l - 1.0));
            [start, end, 4.0 * lambda[0] * lambda[1]]
        }
    }
}

/// Returns the derivatives of [`edge_values`] with respect to s.
fn edge_slopes(degree: Degree, s: f64) -> [f64; 3] {
    match degree {
        Degree::One => [-1.0, 1.0, 0.0],
        Degree::Two => [4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s],
    }
}

/// Returns the length or area of a straight facet.
fn facet_measure<const D: usize>(corners: &[[f64; D]]) -> f64 {
    match corners {
        [a, b] => distance(*a, *b),
        [a, b, c] => {
            let edge_to = |to: &[f64; D]| std::array::from_fn::<f64, 3, _>(|i| to[i] - a[i]);
            0.5 * length(cross(edge_to(b), edge_to(c)))
        }
        other => panic!("a facet of {} vertices", other.len()),
    }
}

/// Returns the area vector. In 2D, this is the first tangent rotated by −90°; in 3D, it is the cross product of
/// the two tangents.
pub fn area_vector<const D: usize>(s: [f64; D], t: [f64; D]) -> [f64; D] {
    let mut normal = [0.0; D];
    match D {
        2 => normal.copy_from_slice(&[s[1], -s[0]]),
        _ => normal.copy_from_slice(&cross([s[0], s[1], s[2]], [t[0], t[1], t[2]])),
    }
    normal
}

/// Member of a boundary group, described as a side of an element.
#[derive(Debug, Clone)]
pub(crate) struct Side {
    /// Index of the element, or of the first element if there are two.
    element: usize,
    /// Local indices of the vertices of the side, counterclockwise as seen from outside.
    corners: &'static [usize],
    /// Whether there is also an element on the other side.
    is_interior: bool,
}

/// Returns the element sides of a group, in the order of its members.
///
/// # Errors
/// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] if its members are
/// of another kind.
fn sides(mesh: &Mesh, group: &str) -> Result<Vec<Side>, FemError> {
    let members = mesh.facets(group)?;
    let key = |mut vertices: Vec<usize>| {
        vertices.sort_unstable();
        vertices
    };
    let keys = members.iter().map(|facet| key(facet.to_vec()));
    let mut found: HashMap<Vec<usize>, Option<Side>> =
        keys.clone().map(|key| (key, None)).collect();
    for (element, vertices) in mesh.elements().enumerate() {
        for &corners in mesh.shape().sides {
            let Some(slot) = found.get_mut(&key(corners.iter().map(|&i| vertices[i]).collect()))
            else {
                continue;
            };
            match slot {
                Some(side) => side.is_interior = true,
                None => {
                    *slot = Some(Side { element, corners, is_interior: false });
                }
            }
        }
    }
    let side = |key| {
        found[&key].clone().expect("Mesh::new checks that group members are sides of elements")
    };
    Ok(keys.map(side).collect())
}

/// Returns the element of each member of a boundary group.
///
/// # Errors
/// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] if its members are
/// of another kind.
pub(crate) fn owners(mesh: &Mesh, group: &str) -> Result<Vec<usize>, FemError> {
    let sides = sides(mesh, group)?;
    Ok(sides.into_iter().map(|side| side.element).collect())
}

/// Returns the members of a boundary group. Their vertices are ordered such that the normals point outward.
///
/// # Errors
/// Returns [`FemError::UnknownGroup`] if the group does not exist, [`FemError::WrongGroup`] if its members are of
/// another kind, or [`FemError::InteriorFacet`] if a member has elements on both sides.
pub(crate) fn outward_facets(space: &Space, group: &str) -> Result<Vec<Vec<usize>>, FemError> {
    let mesh = space.mesh();
    let members = mesh.facets(group)?;
    let facets = sides(mesh, group)?.into_iter().zip(members).map(|(side, member)| {
        if side.is_interior {
            return Err(FemError::InteriorFacet {
                group: group.to_owned(),
                vertices: member.to_vec(),
            });
        }
        let element = mesh.element(side.element);
        Ok(side.corners.iter().map(|&i| element[i]).collect())
    });
    facets.collect()
}

impl Space {
    /// Returns quadrature points and weights for a group of elements or element sides. The sum of the weights is
    /// the measure of the group.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] if its members
    /// are of another kind.
    pub fn quadrature(&self, group: &str) -> Result<Vec<(ElementPoint, f64)>, FemError> {
        let (mesh, shape) = (self.mesh(), self.mesh().shape());
        if let Group::Elements(members) = mesh.group(group)? {
            let rule = Rule::default().points(shape);
            let points = members.iter().flat_map(|&element| {
                rule.iter().map(move |q| {
                    let barycentric = q.barycentric;
                    let measure = self.measure_at(element, &barycentric);
                    (ElementPoint { element, barycentric }, q.weight * measure)
                })
            });
            return Ok(points.collect());
        }
        let rule = facet_points(shape, self.degree());
        let mut points = Vec::new();
        for side in sides(mesh, group)? {
            let element = mesh.element(side.element);
            let vertices: Vec<usize> = side.corners.iter().map(|&i| element[i]).collect();
            let nodes = self.facet_nodes(&vertices);
            for q in &rule {
                let measure = in_dimension!(shape.dimension, |D| measure_at::<D>(self, &nodes, q));
                let mut lambda = vec![0.0; shape.n_vertices()];
                for (&corner, l) in side.corners.iter().zip(&q.barycentric) {
                    lambda[corner] = *l;
                }
                let at =
                    ElementPoint { element: side.element, barycentric: Barycentric::new(&lambda) };
                points.push((at, q.weight * measure));
            }
        }
        Ok(points)
    }
}

fn measure_at<const D: usize>(space: &Space, nodes: &[usize], point: &FacetPoint) -> f64 {
    let points = space.node_points::<D>();
    let positions: Vec<[f64; D]> = nodes.iter().map(|&node| points[node]).collect();
    match is_curved(&positions) {
        true => point.measure(&positions),
        false => facet_measure(&positions[..D]),
    }
}

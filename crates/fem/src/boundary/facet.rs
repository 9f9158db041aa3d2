//! Integrals over parts of the boundary: edges of triangles, faces of tetrahedra.

use std::collections::HashMap;

use crate::element::quadrature::{Rule, edge_degree5};
use crate::element::{Barycentric, Shape, TRIANGLE};
use crate::error::FemError;
use crate::mesh::{Group, Mesh, distance};
use crate::space::{Degree, Located, Space};

/// A quadrature point of the reference facet.
#[derive(Debug, Clone)]
pub(crate) struct FacetPoint {
    /// Fraction of the facet's measure.
    pub(crate) weight: f64,
    /// Barycentric coordinates.
    pub(crate) barycentric: Vec<f64>,
    /// Shape functions of the facet's nodes.
    pub(crate) values: Vec<f64>,
    /// Their derivatives along the first edges from the first vertex: one of an edge, two of a face.
    pub(crate) slopes: Vec<Vec<f64>>,
}

impl FacetPoint {
    /// The measure that a curved facet with nodes at `places` has if it is everywhere what it is
    /// at this point.
    pub(crate) fn measure<const D: usize>(&self, places: &[[f64; D]]) -> f64 {
        let tangent = |slopes: &Vec<f64>| -> [f64; D] {
            std::array::from_fn(|i| slopes.iter().zip(places).map(|(s, x)| s * x[i]).sum())
        };
        let tangents: Vec<[f64; D]> = self.slopes.iter().map(tangent).collect();
        let mut corners = vec![[0.0; D]];
        corners.extend(tangents);
        facet_measure(&corners)
    }
}

/// Whether a node of a facet does not lie in the middle of its edge.
pub(crate) fn is_curved<const D: usize>(places: &[[f64; D]]) -> bool {
    let edges: &[[usize; 2]] = match D {
        2 => &[[0, 1]],
        _ => TRIANGLE.edges,
    };
    let middle =
        |&[a, b]: &[usize; 2]| std::array::from_fn(|m| 0.5 * (places[a][m] + places[b][m]));
    let nodes = places.iter().skip(D);
    nodes.zip(edges).any(|(place, edge)| *place != middle(edge))
}

/// The quadrature points of facets of a body, exact for degree 5 on edges and 6 on faces.
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

/// Shape functions of an edge's ends and its midpoint at the fraction `s` of its length.
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

/// Their derivatives by s.
fn edge_slopes(degree: Degree, s: f64) -> [f64; 3] {
    match degree {
        Degree::One => [-1.0, 1.0, 0.0],
        Degree::Two => [4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s],
    }
}

/// The length or area of a facet.
pub(crate) fn facet_measure<const D: usize>(corners: &[[f64; D]]) -> f64 {
    match corners {
        [a, b] => distance(*a, *b),
        [a, b, c] => {
            let along = |to: &[f64; D]| std::array::from_fn::<f64, 3, _>(|i| to[i] - a[i]);
            let normal = cross(along(b), along(c));
            0.5 * normal.iter().map(|n| n * n).sum::<f64>().sqrt()
        }
        other => panic!("a facet of {} vertices", other.len()),
    }
}

/// a × b.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A member of a boundary group as a side of an element.
#[derive(Debug, Clone)]
pub(crate) struct Side {
    /// The element; the first one of two.
    element: usize,
    /// Its vertices there, in the order of the table: counter-clockwise around the body, or seen
    /// from outside.
    places: &'static [usize],
    /// Whether there is an element on the other side, too.
    inner: bool,
}

/// The sides that make up a group, in its order.
///
/// # Errors
/// [`FemError::UnknownGroup`], [`FemError::WrongGroup`].
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
        for &places in mesh.shape().sides {
            let Some(slot) = found.get_mut(&key(places.iter().map(|&i| vertices[i]).collect()))
            else {
                continue;
            };
            match slot {
                Some(side) => side.inner = true,
                None => {
                    let inner = false;
                    *slot = Some(Side {
                        element,
                        places,
                        inner,
                    });
                }
            }
        }
    }
    let side = |key| {
        found[&key]
            .clone()
            .expect("group members are sides of elements")
    };
    Ok(keys.map(side).collect())
}

/// The members of a boundary group, each with its vertices in the order in which its element has
/// them.
///
/// # Errors
/// [`FemError::UnknownGroup`], [`FemError::WrongGroup`], [`FemError::InnerFacet`] for a member with
/// the body on both sides.
pub(crate) fn outward(space: &Space, group: &str) -> Result<Vec<Vec<usize>>, FemError> {
    let mesh = space.mesh();
    let members = mesh.facets(group)?;
    let outward = sides(mesh, group)?
        .into_iter()
        .zip(members)
        .map(|(side, member)| {
            if side.inner {
                return Err(FemError::InnerFacet {
                    group: group.to_owned(),
                    vertices: member.to_vec(),
                });
            }
            let element = mesh.element(side.element);
            Ok(side.places.iter().map(|&i| element[i]).collect())
        });
    outward.collect()
}

impl Space {
    /// Quadrature over a group of elements or of sides of elements: places with weights that sum to
    /// its measure.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], or [`FemError::WrongGroup`] for other groups.
    pub fn quadrature(&self, group: &str) -> Result<Vec<(Located, f64)>, FemError> {
        let (mesh, shape) = (self.mesh(), self.mesh().shape());
        if let Group::Elements(members) = mesh.group(group)? {
            let rule = Rule::default().points(shape);
            let places = members.iter().flat_map(|&element| {
                rule.iter().map(move |q| {
                    let barycentric = q.barycentric;
                    let measure = self.measure_at(element, &barycentric);
                    (
                        Located {
                            element,
                            barycentric,
                        },
                        q.weight * measure,
                    )
                })
            });
            return Ok(places.collect());
        }
        let rule = facet_points(shape, self.degree());
        let mut places = Vec::new();
        for side in sides(mesh, group)? {
            let element = mesh.element(side.element);
            let vertices: Vec<usize> = side.places.iter().map(|&i| element[i]).collect();
            let nodes = self.facet_nodes(&vertices);
            for q in &rule {
                let measure = match shape.dimension {
                    2 => measure_at::<2>(self, &nodes, q),
                    _ => measure_at::<3>(self, &nodes, q),
                };
                let mut lambda = vec![0.0; shape.n_vertices()];
                for (&place, l) in side.places.iter().zip(&q.barycentric) {
                    lambda[place] = *l;
                }
                let at = Located {
                    element: side.element,
                    barycentric: Barycentric::new(&lambda),
                };
                places.push((at, q.weight * measure));
            }
        }
        Ok(places)
    }
}

/// The measure that a facet has if it is everywhere what it is at a point.
fn measure_at<const D: usize>(space: &Space, nodes: &[usize], point: &FacetPoint) -> f64 {
    let points = space.node_points::<D>();
    let places: Vec<[f64; D]> = nodes.iter().map(|&node| points[node]).collect();
    match is_curved(&places) {
        true => point.measure(&places),
        false => facet_measure(&places[..D]),
    }
}

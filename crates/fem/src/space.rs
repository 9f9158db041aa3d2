//! The pair of finite element spaces: displacement and pressure on the same elements.
//!
//! Owns the numbering of nodes (vertices first, with the mesh's numbers, then midpoints of edges)
//! and of pressures, and evaluation at points. Nodal displacement-like arrays are interleaved (x0,
//! y0, x1, y1, … in the plane) over *all* nodes, constrained ones included; pressure-like arrays
//! have one entry per pressure.
//!
//! Functions with a parameter `D` are for that dimension only, as those of the [mesh](crate::mesh).

use std::collections::HashMap;

pub use crate::element::Degree;
use crate::element::{Barycentric, inverse_map};
use crate::error::FemError;
use crate::mesh::{Group, Mesh, points, sorted};

/// A continuous displacement space and piecewise linear pressures. Paper: eq. (25).
///
/// # Examples
/// ```
/// use myovib_fem::{generate, space::Space};
/// let mesh = generate::rectangle([0.0, 0.0], [2.0, 1.0], [2, 1])?;
/// let space = Space::taylor_hood(&mesh);
/// assert_eq!((space.n_pressures(), space.n_nodes()), (6, 15));
/// let place = space.locate([1.5, 0.25]).expect("inside");
/// let p: Vec<f64> = mesh.points().iter().map(|[x, y]| 3.0 * x - y).collect();
/// assert!((space.pressure_at(&p, &place) - 4.25).abs() < 1e-14);
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Space {
    mesh: Mesh,
    degree: Degree,
    /// As many for each node as there are dimensions.
    coordinates: Vec<f64>,
    /// Midpoint nodes by their edge; empty for degree one.
    midpoints: HashMap<[usize; 2], usize>,
    /// The nodes of each element.
    element_nodes: Vec<usize>,
    /// The pressures at the vertices of each element.
    element_pressures: Vec<usize>,
    /// The vertex of each pressure.
    pressure_vertices: Vec<usize>,
}

/// A place in the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// The element.
    pub element: usize,
    /// Barycentric coordinates in it.
    pub barycentric: Barycentric,
}

impl Space {
    /// Quadratic displacement, linear pressure (P2–P1): stable by the inf–sup condition (27).
    pub fn taylor_hood(mesh: &Mesh) -> Self {
        Self::new(mesh, Degree::Two)
    }

    /// Linear displacement and pressure (P1–P1): the counterexample, which violates (27).
    pub fn equal_order(mesh: &Mesh) -> Self {
        Self::new(mesh, Degree::One)
    }

    fn new(mesh: &Mesh, degree: Degree) -> Self {
        let dimension = mesh.dimension();
        let mut coordinates = mesh.coordinates().to_vec();
        let mut midpoints = HashMap::new();
        let mut element_nodes =
            Vec::with_capacity(mesh.n_elements() * mesh.shape().n_nodes(degree));
        for element in mesh.elements() {
            element_nodes.extend_from_slice(element);
            if degree == Degree::One {
                continue;
            }
            for edge @ [p, q] in mesh.edges_of(element) {
                let node = *midpoints.entry(edge).or_insert_with(|| {
                    for m in 0..dimension {
                        let (a, b) = (
                            coordinates[dimension * p + m],
                            coordinates[dimension * q + m],
                        );
                        coordinates.push(0.5 * (a + b));
                    }
                    coordinates.len() / dimension - 1
                });
                element_nodes.push(node);
            }
        }
        Self {
            degree,
            coordinates,
            midpoints,
            element_nodes,
            element_pressures: mesh.elements().flatten().copied().collect(),
            pressure_vertices: (0..mesh.n_points()).collect(),
            mesh: mesh.clone(),
        }
    }

    /// The mesh underneath.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Number of coordinates of a point and of components of a displacement.
    pub fn dimension(&self) -> usize {
        self.mesh.dimension()
    }

    /// Degree of the displacement.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// Number of displacement nodes, constrained ones included.
    pub fn n_nodes(&self) -> usize {
        self.coordinates.len() / self.dimension()
    }

    /// Length of a displacement-like array: the components of all nodes.
    pub fn n_components(&self) -> usize {
        self.coordinates.len()
    }

    /// Number of pressures: one for each vertex.
    pub fn n_pressures(&self) -> usize {
        self.pressure_vertices.len()
    }

    /// The vertex of each pressure.
    pub fn pressure_vertices(&self) -> &[usize] {
        &self.pressure_vertices
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.mesh.n_elements()
    }

    /// Where the nodes lie: the vertices, then the midpoints.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub fn node_points<const D: usize>(&self) -> &[[f64; D]] {
        points(&self.coordinates, self.dimension())
    }

    /// Where a node lies.
    pub fn node_point(&self, node: usize) -> &[f64] {
        let dimension = self.dimension();
        &self.coordinates[dimension * node..][..dimension]
    }

    /// The coordinates of all nodes, one node after the other: a displacement-like array.
    pub fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// The displacement nodes of an element: vertices, then midpoints of its edges.
    pub fn element_nodes(&self, element: usize) -> &[usize] {
        let n = self.mesh.shape().n_nodes(self.degree);
        &self.element_nodes[n * element..][..n]
    }

    /// The pressures at the vertices of an element.
    pub fn element_pressures(&self, element: usize) -> &[usize] {
        let n = self.mesh.shape().n_vertices();
        &self.element_pressures[n * element..][..n]
    }

    /// The nodes of an edge or a face of the mesh: its vertices, then (quadratic) the midpoints of
    /// its edges.
    ///
    /// # Panics
    /// If it is none of the mesh. Edges and faces of groups always are.
    pub fn facet_nodes(&self, facet: &[usize]) -> Vec<usize> {
        let mut nodes = facet.to_vec();
        if self.degree == Degree::Two {
            let edges: &[[usize; 2]] = match facet.len() {
                2 => &[[0, 1]],
                _ => crate::element::TRIANGLE.edges,
            };
            let midpoint = |edge: &[usize; 2]| self.midpoints[&sorted(edge.map(|i| facet[i]))];
            nodes.extend(edges.iter().map(midpoint));
        }
        nodes
    }

    /// The nodes, vertices and midpoints, on a group, in ascending order.
    pub fn nodes_on(&self, group: &Group) -> Vec<usize> {
        let mut nodes: Vec<usize> = match group {
            Group::Points(vertices) => vertices.clone(),
            Group::Edges(edges) => edges.iter().flat_map(|e| self.facet_nodes(e)).collect(),
            Group::Faces(faces) => faces.iter().flat_map(|f| self.facet_nodes(f)).collect(),
            Group::Elements(members) => members
                .iter()
                .flat_map(|&e| self.element_nodes(e))
                .copied()
                .collect(),
        };
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// The nodes on the group of that name.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`].
    pub fn nodes_of(&self, name: &str) -> Result<Vec<usize>, FemError> {
        Ok(self.nodes_on(self.mesh.group(name)?))
    }

    /// Finds the element that holds a point, or `None` outside the mesh.
    ///
    /// A point between elements (up to rounding) belongs to the first one that has it.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub fn locate<const D: usize>(&self, point: [f64; D]) -> Option<Located> {
        // Rounding of coordinates of the mesh's size, seen through the inverse map.
        const SLACK: f64 = 1e-10;
        let points = self.mesh.points::<D>();
        (0..self.n_elements()).find_map(|element| {
            let mut corners = [[0.0; D]; 4];
            for (corner, &vertex) in corners.iter_mut().zip(self.mesh.element(element)) {
                *corner = points[vertex];
            }
            let (inverse, _) = inverse_map(&corners);
            let mut lambda = [0.0; 4];
            for (lambda, row) in lambda[1..].iter_mut().zip(&inverse) {
                let terms = row.iter().zip(point.iter().zip(corners[0]));
                *lambda = terms.map(|(slope, (x, origin))| slope * (x - origin)).sum();
            }
            lambda[0] = lambda[1..].iter().fold(1.0, |rest, l| rest - l);
            let lambda = &lambda[..=D];
            lambda.iter().all(|&l| l >= -SLACK).then(|| Located {
                element,
                barycentric: Barycentric::new(lambda),
            })
        })
    }

    /// The displacement at a place as a linear functional: nodes and weights, the same for all
    /// components.
    pub fn displacement_functional(&self, at: &Located) -> Vec<(usize, f64)> {
        let nodes = self.element_nodes(at.element).iter().copied();
        nodes
            .zip(self.mesh.shape().values(self.degree, &at.barycentric))
            .collect()
    }

    /// The pressure at a place as a linear functional: pressures and weights.
    pub fn pressure_functional(&self, at: &Located) -> Vec<(usize, f64)> {
        let pressures = self.element_pressures(at.element).iter().copied();
        pressures.zip(at.barycentric.iter().copied()).collect()
    }

    /// A displacement-like field at a place.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub fn displacement_at<const D: usize>(&self, u: &[f64], at: &Located) -> [f64; D] {
        let u = points(u, self.dimension());
        let mut value = [0.0; D];
        for (node, weight) in self.displacement_functional(at) {
            let u: [f64; D] = u[node];
            for (value, u) in value.iter_mut().zip(u) {
                *value += weight * u;
            }
        }
        value
    }

    /// A pressure-like field at a place.
    pub fn pressure_at(&self, p: &[f64], at: &Located) -> f64 {
        self.pressure_functional(at)
            .iter()
            .map(|&(pressure, weight)| weight * p[pressure])
            .sum()
    }
}

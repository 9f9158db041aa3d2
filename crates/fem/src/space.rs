//! The pair of finite element spaces: displacement and pressure on the same triangles.
//!
//! Owns the numbering of nodes (vertices first, with the mesh's numbers, then midpoints of edges),
//! and evaluation at points. Nodal displacement-like arrays are interleaved (x0, y0, x1, y1, …)
//! over *all* nodes, constrained ones included; pressure-like arrays have one entry per vertex.

use std::collections::HashMap;

use crate::element::{inverse_map, p2_values};
use crate::error::FemError;
use crate::mesh::{Group, Mesh, sorted, triangle_edges};

/// Degree of the displacement's shape functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Degree {
    /// Linear: nodes at the vertices.
    One,
    /// Quadratic: nodes at vertices and midpoints of edges.
    Two,
}

/// A continuous displacement space and the continuous piecewise linear pressures. Paper: eq. (25).
///
/// # Examples
/// ```
/// use myovib_fem::{generate, space::Space};
/// let mesh = generate::rectangle([0.0, 0.0], [2.0, 1.0], [2, 1])?;
/// let space = Space::taylor_hood(&mesh);
/// assert_eq!((space.n_vertices(), space.n_nodes()), (6, 15));
/// let place = space.locate([1.5, 0.25]).expect("inside");
/// let p: Vec<f64> = space.node_points()[..6].iter().map(|x| 3.0 * x[0] - x[1]).collect();
/// assert!((space.pressure_at(&p, &place) - 4.25).abs() < 1e-14);
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Space {
    mesh: Mesh,
    degree: Degree,
    node_points: Vec<[f64; 2]>,
    /// Midpoint nodes by their edge; empty for degree one.
    midpoints: HashMap<[usize; 2], usize>,
    /// Six nodes per element; for degree one only the first three are meant.
    element_nodes: Vec<[usize; 6]>,
}

/// A place in the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// The triangle.
    pub element: usize,
    /// Barycentric coordinates in it.
    pub barycentric: [f64; 3],
}

impl Space {
    /// Quadratic displacement, linear pressure (P2–P1): stable by the inf–sup condition (27).
    pub fn taylor_hood(mesh: &Mesh) -> Self {
        let mut space = Self::equal_order(mesh);
        space.degree = Degree::Two;
        for (corners, nodes) in mesh.triangles().iter().zip(&mut space.element_nodes) {
            for (node, edge @ [p, q]) in nodes[3..].iter_mut().zip(triangle_edges(corners)) {
                *node = *space.midpoints.entry(edge).or_insert_with(|| {
                    let (a, b) = (space.node_points[p], space.node_points[q]);
                    space
                        .node_points
                        .push([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
                    space.node_points.len() - 1
                });
            }
        }
        space
    }

    /// Linear displacement and pressure (P1–P1): the counterexample, which violates (27).
    pub fn equal_order(mesh: &Mesh) -> Self {
        Self {
            degree: Degree::One,
            node_points: mesh.points().to_vec(),
            midpoints: HashMap::new(),
            element_nodes: mesh
                .triangles()
                .iter()
                .map(|&[a, b, c]| [a, b, c, 0, 0, 0])
                .collect(),
            mesh: mesh.clone(),
        }
    }

    /// The mesh underneath.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Degree of the displacement.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// Number of displacement nodes, constrained ones included.
    pub fn n_nodes(&self) -> usize {
        self.node_points.len()
    }

    /// Number of vertices, which carry the pressure.
    pub fn n_vertices(&self) -> usize {
        self.mesh.points().len()
    }

    /// Number of triangles.
    pub fn n_elements(&self) -> usize {
        self.element_nodes.len()
    }

    /// Where the nodes lie: the vertices, then the midpoints.
    pub fn node_points(&self) -> &[[f64; 2]] {
        &self.node_points
    }

    /// The displacement nodes of a triangle: corners, then midpoints of edges 01, 12, 20.
    pub fn element_nodes(&self, element: usize) -> &[usize] {
        match self.degree {
            Degree::One => &self.element_nodes[element][..3],
            Degree::Two => &self.element_nodes[element],
        }
    }

    /// The corners of a triangle.
    pub fn element_vertices(&self, element: usize) -> [usize; 3] {
        self.mesh.triangles()[element]
    }

    /// The nodes of a mesh edge: its ends, then (quadratic) its midpoint.
    ///
    /// # Panics
    /// If it is not an edge of the mesh. Edges of groups always are.
    pub fn edge_nodes(&self, edge: [usize; 2]) -> Vec<usize> {
        let mut nodes = edge.to_vec();
        if self.degree == Degree::Two {
            nodes.push(self.midpoints[&sorted(edge)]);
        }
        nodes
    }

    /// The nodes, corners and midpoints, on a group, in ascending order.
    pub fn nodes_on(&self, group: &Group) -> Vec<usize> {
        let mut nodes: Vec<usize> = match group {
            Group::Points(vertices) => vertices.clone(),
            Group::Edges(edges) => edges.iter().flat_map(|&e| self.edge_nodes(e)).collect(),
            Group::Triangles(members) => members
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

    /// Finds the triangle that holds a point, or `None` outside the mesh.
    ///
    /// A point on an edge (up to rounding) belongs to the first triangle that has it.
    pub fn locate(&self, point: [f64; 2]) -> Option<Located> {
        // Rounding of coordinates of the mesh's size, seen through the inverse map.
        const SLACK: f64 = 1e-10;
        (0..self.n_elements()).find_map(|element| {
            let corners = self.mesh.corners(element);
            let (inverse, _) = inverse_map(corners);
            let offset = [point[0] - corners[0][0], point[1] - corners[0][1]];
            let [xi, eta] = inverse.map(|row| row[0] * offset[0] + row[1] * offset[1]);
            let barycentric = [1.0 - xi - eta, xi, eta];
            barycentric.iter().all(|&l| l >= -SLACK).then_some(Located {
                element,
                barycentric,
            })
        })
    }

    /// The displacement at a place as a linear functional: nodes and weights, the same for both
    /// components.
    pub fn displacement_functional(&self, at: &Located) -> Vec<(usize, f64)> {
        let nodes = self.element_nodes(at.element).iter().copied();
        match self.degree {
            Degree::One => nodes.zip(at.barycentric).collect(),
            Degree::Two => nodes.zip(p2_values(at.barycentric)).collect(),
        }
    }

    /// The pressure at a place as a linear functional: vertices and weights.
    pub fn pressure_functional(&self, at: &Located) -> Vec<(usize, f64)> {
        self.element_vertices(at.element)
            .into_iter()
            .zip(at.barycentric)
            .collect()
    }

    /// A displacement-like field at a place.
    pub fn displacement_at(&self, u: &[f64], at: &Located) -> [f64; 2] {
        let mut value = [0.0; 2];
        for (node, weight) in self.displacement_functional(at) {
            value[0] += weight * u[2 * node];
            value[1] += weight * u[2 * node + 1];
        }
        value
    }

    /// A pressure-like field at a place.
    pub fn pressure_at(&self, p: &[f64], at: &Located) -> f64 {
        self.pressure_functional(at)
            .iter()
            .map(|&(vertex, weight)| weight * p[vertex])
            .sum()
    }
}

//! The pair of finite element spaces: displacement and pressure on the same elements.
//!
//! Owns the numbering of nodes (vertices first, with the mesh's numbers, then midpoints of edges)
//! and of pressures, and evaluation at points. Nodal displacement-like arrays are interleaved (x0,
//! y0, x1, y1, … in the plane) over *all* nodes, constrained ones included; pressure-like arrays
//! have one entry per pressure.
//!
//! Functions with a parameter `D` are for that dimension only, as those of the [mesh](crate::mesh).

pub mod dofs;
pub(crate) mod sparsity;

use std::collections::{BTreeSet, HashMap};

pub use crate::element::Degree;
use crate::element::quadrature::Rule;
use crate::element::{self, Barycentric, inverse_map};
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
    /// Whether an edge of the element is curved.
    curved: Vec<bool>,
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

    /// The same space with pressures that jump between regions: at a vertex between regions each has
    /// its own. `regions` has a number for each element.
    ///
    /// Where the bulk modulus or the law changes the pressure is not continuous, and a continuous one
    /// would not converge with its order.
    ///
    /// # Errors
    /// [`FemError::Count`] if there is not one number for each element.
    pub fn with_regions(mut self, regions: &[usize]) -> Result<Self, FemError> {
        if regions.len() != self.n_elements() {
            return Err(FemError::Count {
                what: "regions, one per element",
                found: regions.len(),
                needed: self.n_elements(),
            });
        }
        let elements = || self.mesh.elements().zip(regions);
        let of_element = |(vertices, &region): (&'_ [usize], &usize)| -> Vec<[usize; 2]> {
            vertices.iter().map(|&vertex| [region, vertex]).collect()
        };
        // Regions one after the other, in each the vertices in the order of the mesh.
        let owned: BTreeSet<[usize; 2]> = elements().flat_map(of_element).collect();
        let numbers: HashMap<[usize; 2], usize> = owned
            .iter()
            .enumerate()
            .map(|(number, owner)| (*owner, number))
            .collect();
        let pressures = elements().flat_map(of_element).map(|owner| numbers[&owner]);
        self.element_pressures = pressures.collect();
        self.pressure_vertices = owned.iter().map(|&[_, vertex]| vertex).collect();
        Ok(self)
    }

    fn new(mesh: &Mesh, degree: Degree) -> Self {
        let dimension = mesh.dimension();
        let mut coordinates = mesh.coordinates().to_vec();
        let mut midpoints = HashMap::new();
        let n_nodes = mesh.shape().n_nodes(degree);
        let mut element_nodes = Vec::with_capacity(mesh.n_elements() * n_nodes);
        let mut curved = vec![false; mesh.n_elements()];
        for (element, curved) in mesh.elements().zip(&mut curved) {
            element_nodes.extend_from_slice(element);
            if degree == Degree::One {
                continue;
            }
            for edge @ [p, q] in mesh.edges_of(element) {
                let bent = mesh.bent_midpoint(edge);
                *curved |= bent.is_some();
                let node = *midpoints.entry(edge).or_insert_with(|| {
                    for m in 0..dimension {
                        let (a, b) = (
                            coordinates[dimension * p + m],
                            coordinates[dimension * q + m],
                        );
                        coordinates.push(bent.map_or(0.5 * (a + b), |place| place[m]));
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
            curved,
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

    /// Number of pressures: one for each vertex, in each region that has it.
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

    /// Whether an element has curved edges, and so a map that is not affine (isoparametric).
    pub fn is_curved(&self, element: usize) -> bool {
        self.curved[element]
    }

    /// ∂ξ/∂x at a place, and the measure that an element has if its map is there what it is here.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub(crate) fn map_at<const D: usize>(
        &self,
        element: usize,
        lambda: &[f64],
    ) -> ([[f64; D]; D], f64) {
        let (shape, points) = (self.mesh.shape(), self.node_points::<D>());
        let places =
            |nodes: &[usize]| -> Vec<[f64; D]> { nodes.iter().map(|&n| points[n]).collect() };
        let (inverse, det) = if self.curved[element] {
            let gradients = shape.gradients(self.degree, lambda);
            element::inverse(element::jacobian(
                &places(self.element_nodes(element)),
                &gradients,
            ))
        } else {
            inverse_map(&places(self.mesh.element(element)))
        };
        (inverse, shape.reference_measure * det)
    }

    /// The measure that an element has if its map is everywhere what it is at a place.
    pub(crate) fn measure_at(&self, element: usize, lambda: &[f64]) -> f64 {
        match self.dimension() {
            2 => self.map_at::<2>(element, lambda).1,
            _ => self.map_at::<3>(element, lambda).1,
        }
    }

    /// The area or volume, of curved elements too.
    pub fn measure(&self) -> f64 {
        // The determinant of a quadratic map has degree 3 in space.
        let rule = Rule::Degree4.points(self.mesh.shape());
        let of_curved = |element| {
            let parts = rule
                .iter()
                .map(|q| q.weight * self.measure_at(element, &q.barycentric));
            parts.sum::<f64>()
        };
        let of = |element| match self.curved[element] {
            true => of_curved(element),
            false => self.mesh.measure_of(element),
        };
        (0..self.n_elements()).map(of).sum()
    }

    /// Where a place lies.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub fn place<const D: usize>(&self, at: &Located) -> [f64; D] {
        self.displacement_at(&self.coordinates, at)
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
                _ => element::TRIANGLE.edges,
            };
            let midpoint = |edge: &[usize; 2]| self.midpoints[&sorted(edge.map(|i| facet[i]))];
            nodes.extend(edges.iter().map(midpoint));
        }
        nodes
    }

    /// The vertices in whose middle each node lies: itself twice, or the ends of its edge.
    pub fn node_ends(&self) -> Vec<[usize; 2]> {
        let mut ends: Vec<[usize; 2]> = (0..self.n_nodes()).map(|node| [node; 2]).collect();
        for (&edge, &node) in &self.midpoints {
            ends[node] = edge;
        }
        ends
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
        let located = |element| {
            let barycentric = match self.curved[element] {
                false => self.pull_back(element, point),
                true => self.pull_back_curved(element, point)?,
            };
            let inside = barycentric.iter().all(|&l| l >= -SLACK);
            inside.then_some(Located {
                element,
                barycentric,
            })
        };
        (0..self.n_elements()).find_map(located)
    }

    /// Barycentric coordinates of a point in an element taken as straight.
    fn pull_back<const D: usize>(&self, element: usize, point: [f64; D]) -> Barycentric {
        let points = self.mesh.points::<D>();
        let vertices = self.mesh.element(element).iter();
        let corners: Vec<[f64; D]> = vertices.map(|&v| points[v]).collect();
        let (inverse, _) = inverse_map(&corners);
        let mut lambda = [0.0; 4];
        for (lambda, row) in lambda[1..].iter_mut().zip(&inverse) {
            let terms = row.iter().zip(point.iter().zip(corners[0]));
            *lambda = terms.map(|(slope, (x, origin))| slope * (x - origin)).sum();
        }
        lambda[0] = lambda[1..].iter().fold(1.0, |rest, l| rest - l);
        Barycentric::new(&lambda[..=D])
    }

    /// The same in a curved element, by Newton's method; none where it does not converge.
    fn pull_back_curved<const D: usize>(
        &self,
        element: usize,
        point: [f64; D],
    ) -> Option<Barycentric> {
        // A step this small ends the iteration, whose convergence is quadratic.
        const CONVERGED: f64 = 1e-12;
        let mut barycentric = self.pull_back(element, point);
        for _ in 0..20 {
            let at = Located {
                element,
                barycentric,
            };
            let (place, (inverse, _)) = (
                self.place::<D>(&at),
                self.map_at::<D>(element, &barycentric),
            );
            let mut lambda = barycentric.to_vec();
            let mut largest = 0.0_f64;
            for (m, row) in inverse.iter().enumerate() {
                let step: f64 = (0..D).map(|i| row[i] * (point[i] - place[i])).sum();
                lambda[m + 1] += step;
                lambda[0] -= step;
                largest = largest.max(step.abs());
            }
            barycentric = Barycentric::new(&lambda);
            if largest < CONVERGED {
                return Some(barycentric);
            }
        }
        None
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

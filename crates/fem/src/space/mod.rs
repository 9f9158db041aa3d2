//! Finite element spaces for displacement and pressure on the same mesh.
//!
//! A [`Space`] numbers the nodes and the pressures, and evaluates fields at points. The nodes are the vertices
//! with their mesh indices, followed by the edge midpoints. Displacement-like arrays are interleaved (x0, y0, x1,
//! y1, … in 2D) over *all* nodes, including constrained ones. Pressure-like arrays have one entry per pressure.
//!
//! As in [mesh](crate::mesh), functions with a parameter `D` panic if the dimension of the space is not `D`.

pub mod dofs;
mod nearest;
pub(crate) mod sparsity;
mod tied;

use std::collections::{BTreeSet, HashMap};

pub use self::nearest::Near;
pub use self::tied::HeldPressures;
pub use crate::element::Degree;
use crate::element::quadrature::Rule;
use crate::element::{self, Barycentric, inverse_map};
use crate::error::FemError;
use crate::mesh::{Group, Mesh, points, sorted};

/// Continuous displacement space with piecewise linear pressures. Paper, eq. (25).
///
/// # Examples
/// ```
/// use myovib_fem::{generate, space::Space};
/// let mesh = generate::rectangle([0.0, 0.0], [2.0, 1.0], [2, 1])?;
/// let space = Space::taylor_hood(&mesh);
/// assert_eq!((space.n_pressures(), space.n_nodes()), (6, 15));
/// let point = space.locate([1.5, 0.25]).expect("inside");
/// let p: Vec<f64> = mesh.points().iter().map(|[x, y]| 3.0 * x - y).collect();
/// assert!((space.pressure_at(&p, &point) - 4.25).abs() < 1e-14);
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Space {
    mesh: Mesh,
    degree: Degree,
    /// Node coordinates, `dimension` values per node.
    coordinates: Vec<f64>,
    /// Midpoint nodes, keyed by the sorted ends of their edge. The map is empty for degree one.
    midpoints: HashMap<[usize; 2], usize>,
    element_nodes: Vec<usize>,
    element_pressures: Vec<usize>,
    pressure_vertices: Vec<usize>,
    /// Whether each element has a curved edge.
    curved: Vec<bool>,
}

/// Point in an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementPoint {
    /// Index of the element.
    pub element: usize,
    /// Barycentric coordinates in the element.
    pub barycentric: Barycentric,
}

impl Space {
    /// Creates the Taylor–Hood pair P2–P1 with quadratic displacement and linear pressure, which satisfies the
    /// inf–sup condition (27).
    pub fn taylor_hood(mesh: &Mesh) -> Self {
        Self::new(mesh, Degree::Two)
    }

    /// Creates the equal-order pair P1–P1, which violates (27) and serves as a counterexample.
    pub fn equal_order(mesh: &Mesh) -> Self {
        Self::new(mesh, Degree::One)
    }

    /// Returns the space in which the pressure is discontinuous across regions: a vertex between regions has one
    /// pressure per region. `regions` holds the region of each element.
    ///
    /// The exact pressure has a jump where the bulk modulus or the law changes. There, a continuous approximation
    /// would lose its order of convergence.
    ///
    /// # Errors
    /// Returns [`FemError::Count`] unless `regions` has one entry per element.
    pub fn with_regions(mut self, regions: &[usize]) -> Result<Self, FemError> {
        if regions.len() != self.n_elements() {
            return Err(FemError::Count {
                what: "regions, one per element",
                found: regions.len(),
                needed: self.n_elements(),
            });
        }
        let elements = || self.mesh.elements().zip(regions);
        let owners = |(vertices, &region): (&'_ [usize], &usize)| -> Vec<[usize; 2]> {
            vertices.iter().map(|&vertex| [region, vertex]).collect()
        };
        // Pressures are numbered by region and then by vertex.
        let owned: BTreeSet<[usize; 2]> = elements().flat_map(owners).collect();
        let numbers: HashMap<[usize; 2], usize> =
            owned.iter().enumerate().map(|(number, owner)| (*owner, number)).collect();
        let pressures = elements().flat_map(owners).map(|owner| numbers[&owner]);
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
                let midpoint = mesh.curved_midpoint(edge);
                *curved |= midpoint.is_some();
                let node = *midpoints.entry(edge).or_insert_with(|| {
                    for m in 0..dimension {
                        let (a, b) =
                            (coordinates[dimension * p + m], coordinates[dimension * q + m]);
                        coordinates.push(midpoint.map_or(0.5 * (a + b), |point| point[m]));
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

    /// Returns the mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the number of coordinates of a point, which is also the number of displacement components.
    pub fn dimension(&self) -> usize {
        self.mesh.dimension()
    }

    /// Returns the degree of the displacement.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// Returns the number of displacement nodes, including constrained nodes.
    pub fn n_nodes(&self) -> usize {
        self.coordinates.len() / self.dimension()
    }

    /// Returns the length of a displacement-like array, which is the number of nodes times the number of
    /// components.
    pub fn n_components(&self) -> usize {
        self.coordinates.len()
    }

    /// Returns the number of pressures, which is one per vertex and region that contains it.
    pub fn n_pressures(&self) -> usize {
        self.pressure_vertices.len()
    }

    /// Returns the vertex of each pressure.
    pub fn pressure_vertices(&self) -> &[usize] {
        &self.pressure_vertices
    }

    /// Returns the number of elements.
    pub fn n_elements(&self) -> usize {
        self.mesh.n_elements()
    }

    /// Returns the positions of the nodes: first the vertices, then the midpoints.
    pub fn node_points<const D: usize>(&self) -> &[[f64; D]] {
        points(&self.coordinates, self.dimension())
    }

    /// Returns the position of a node.
    pub fn node_point(&self, node: usize) -> &[f64] {
        let dimension = self.dimension();
        &self.coordinates[dimension * node..][..dimension]
    }

    /// Returns the coordinates of all nodes as a displacement-like array.
    pub fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// Returns the displacement nodes of an element: first the vertices, then the edge midpoints.
    pub fn element_nodes(&self, element: usize) -> &[usize] {
        let n = self.mesh.shape().n_nodes(self.degree);
        &self.element_nodes[n * element..][..n]
    }

    /// Returns the pressures at the vertices of an element.
    pub fn element_pressures(&self, element: usize) -> &[usize] {
        let n = self.mesh.shape().n_vertices();
        &self.element_pressures[n * element..][..n]
    }

    /// Returns whether an element has curved edges. In this case, its isoparametric map is not affine.
    pub fn is_curved(&self, element: usize) -> bool {
        self.curved[element]
    }

    /// Returns ∂ξ/∂x at a point, and the local measure, which is the determinant of ∂x/∂ξ at the point times the
    /// reference measure.
    pub(crate) fn map_at<const D: usize>(
        &self,
        element: usize,
        lambda: &[f64],
    ) -> ([[f64; D]; D], f64) {
        let (shape, points) = (self.mesh.shape(), self.node_points::<D>());
        let positions =
            |nodes: &[usize]| -> Vec<[f64; D]> { nodes.iter().map(|&n| points[n]).collect() };
        let (inverse, det) = if self.curved[element] {
            let gradients = shape.gradients(self.degree, lambda);
            element::inverse(element::jacobian(&positions(self.element_nodes(element)), &gradients))
        } else {
            inverse_map(&positions(self.mesh.element(element)))
        };
        (inverse, shape.reference_measure * det)
    }

    /// Returns the local measure at a point, which is det ∂x/∂ξ times the reference measure.
    pub(crate) fn measure_at(&self, element: usize, lambda: &[f64]) -> f64 {
        in_dimension!(self.dimension(), |D| self.map_at::<D>(element, lambda).1)
    }

    /// Returns the total area or volume, including curved elements.
    pub fn measure(&self) -> f64 {
        (0..self.n_elements()).map(|element| self.measure_of(element)).sum()
    }

    /// Returns the area or volume of an element, which may be curved.
    pub fn measure_of(&self, element: usize) -> f64 {
        if !self.curved[element] {
            return self.mesh.measure_of(element);
        }
        // The determinant of a quadratic map has degree 3 in 3D.
        let rule = Rule::Degree4.points(self.mesh.shape());
        rule.iter().map(|q| q.weight * self.measure_at(element, &q.barycentric)).sum()
    }

    /// Returns the position of a point.
    pub fn position<const D: usize>(&self, at: &ElementPoint) -> [f64; D] {
        self.displacement_at(&self.coordinates, at)
    }

    /// Returns the nodes of an edge or face: first its vertices, then (for degree two) the midpoints of its edges.
    ///
    /// # Panics
    /// Panics if the edge or face is not in the mesh. Edges and faces of groups are always in the mesh.
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

    /// Returns the two vertices whose midpoint is each node. For a vertex, this is the vertex twice; for an edge
    /// midpoint, these are the ends of the edge.
    pub fn node_ends(&self) -> Vec<[usize; 2]> {
        let mut ends: Vec<[usize; 2]> = (0..self.n_nodes()).map(|node| [node; 2]).collect();
        for (&edge, &node) in &self.midpoints {
            ends[node] = edge;
        }
        ends
    }

    /// Returns the nodes (vertices and midpoints) of a group in ascending order.
    pub fn nodes_on(&self, group: &Group) -> Vec<usize> {
        let mut nodes: Vec<usize> = match group {
            Group::Points(vertices) => vertices.clone(),
            Group::Edges(edges) => edges.iter().flat_map(|e| self.facet_nodes(e)).collect(),
            Group::Faces(faces) => faces.iter().flat_map(|f| self.facet_nodes(f)).collect(),
            Group::Elements(members) => {
                members.iter().flat_map(|&e| self.element_nodes(e)).copied().collect()
            }
        };
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Returns the nodes of the group with the given name in ascending order.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist.
    pub fn nodes_of(&self, name: &str) -> Result<Vec<usize>, FemError> {
        Ok(self.nodes_on(self.mesh.group(name)?))
    }

    /// Returns the element that contains a point and the barycentric coordinates of the point, or `None` if the
    /// point is outside the mesh.
    ///
    /// A point on the boundary of several elements (up to rounding) is assigned to the first of these elements.
    pub fn locate<const D: usize>(&self, point: [f64; D]) -> Option<ElementPoint> {
        // Bound on the rounding errors of coordinates, which the inverse map amplifies.
        const TOLERANCE: f64 = 1e-10;
        let located = |element| {
            let barycentric = match self.curved[element] {
                false => self.barycentric_in(element, point),
                true => self.barycentric_in_curved(element, point)?,
            };
            let inside = barycentric.iter().all(|&l| l >= -TOLERANCE);
            inside.then_some(ElementPoint { element, barycentric })
        };
        (0..self.n_elements()).find_map(located)
    }

    /// Returns the barycentric coordinates of a point in an element, ignoring curved edges.
    fn barycentric_in<const D: usize>(&self, element: usize, point: [f64; D]) -> Barycentric {
        let points = self.mesh.points::<D>();
        let vertices = self.mesh.element(element).iter();
        let corners: Vec<[f64; D]> = vertices.map(|&v| points[v]).collect();
        let (inverse, _) = inverse_map(&corners);
        let mut lambda = [0.0; 4];
        for (lambda, row) in lambda[1..].iter_mut().zip(&inverse) {
            let terms = row.iter().zip(point.iter().zip(corners[0]));
            *lambda = terms.map(|(slope, (x, origin))| slope * (x - origin)).sum();
        }
        lambda[0] = lambda[1..].iter().fold(1.0, |remainder, l| remainder - l);
        Barycentric::new(&lambda[..=D])
    }

    /// Returns the barycentric coordinates of a point in a curved element, computed by Newton's method, or `None`
    /// if the method does not converge.
    fn barycentric_in_curved<const D: usize>(
        &self,
        element: usize,
        point: [f64; D],
    ) -> Option<Barycentric> {
        // Step size below which the quadratically convergent iteration stops.
        const CONVERGED: f64 = 1e-12;
        let mut barycentric = self.barycentric_in(element, point);
        for _ in 0..20 {
            let at = ElementPoint { element, barycentric };
            let (position, (inverse, _)) =
                (self.position::<D>(&at), self.map_at::<D>(element, &barycentric));
            let mut lambda = barycentric.to_vec();
            let mut largest = 0.0_f64;
            for (m, row) in inverse.iter().enumerate() {
                let step: f64 = (0..D).map(|i| row[i] * (point[i] - position[i])).sum();
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

    /// Returns the displacement at a point as a linear functional, given by nodes and weights. The weights are
    /// equal for all components.
    pub fn displacement_functional(&self, at: &ElementPoint) -> Vec<(usize, f64)> {
        let nodes = self.element_nodes(at.element).iter().copied();
        nodes.zip(self.mesh.shape().values(self.degree, &at.barycentric)).collect()
    }

    /// Returns the pressure at a point as a linear functional, given by pressures and weights.
    pub fn pressure_functional(&self, at: &ElementPoint) -> Vec<(usize, f64)> {
        let pressures = self.element_pressures(at.element).iter().copied();
        pressures.zip(at.barycentric.iter().copied()).collect()
    }

    /// Evaluates a displacement-like field at a point.
    pub fn displacement_at<const D: usize>(&self, u: &[f64], at: &ElementPoint) -> [f64; D] {
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

    /// Evaluates a pressure-like field at a point.
    pub fn pressure_at(&self, p: &[f64], at: &ElementPoint) -> f64 {
        self.pressure_functional(at).iter().map(|&(pressure, weight)| weight * p[pressure]).sum()
    }
}

//! Meshes of triangles or tetrahedra with named groups.
//!
//! A [`Mesh`] owns points, elements and the physical groups to which scenes refer. It is always valid, because
//! [`Mesh::new`] checks the following conditions: elements have positive measure, share whole edges (in 3D, faces)
//! and do not overlap; every vertex belongs to an element; group edges and faces belong to elements and are listed
//! once. [`Mesh::notes`] lists the corrections that were made.
//!
//! The dimension is a property of the mesh. Functions with a parameter `D` return points as arrays of `D`
//! coordinates, and functions with a parameter `V` return arrays of `V` vertices per element. These functions
//! panic if `D` or `V` does not match the mesh.

mod attributes;
mod boxes;
mod conforming;
mod curved;
pub(crate) mod defect;
mod facets;
pub mod generate;
mod msh;
pub(crate) mod note;
mod parts;
mod refine;
mod select;
pub(crate) mod simplices;

use std::collections::{BTreeMap, BTreeSet};

use crate::element::{Shape, inverse_map};
use crate::error::FemError;

pub use attributes::NodalField;
pub use boxes::bounds;
pub use defect::{DefectKind, ElementName, MeshDefect};
pub use note::MeshNote;

/// Relative measure, measure / (longest edge)^D, below which an element is degenerate. The value corresponds to an
/// angle of 1e-12 rad, for which gradients are accurate to at most four digits.
const DEGENERATE: f64 = 1e-12;

/// Members of a physical group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Group {
    /// Vertices, given by index.
    Points(Vec<usize>),
    /// Edges, given by their two vertices. These are sides of triangles, or curves in 3D.
    Edges(Vec<[usize; 2]>),
    /// Faces of tetrahedra, given by their three vertices.
    Faces(Vec<[usize; 3]>),
    /// Triangles or tetrahedra, given by index.
    Elements(Vec<usize>),
}

impl Group {
    /// Returns whether the group has no members.
    pub fn is_empty(&self) -> bool {
        match self {
            Group::Points(members) | Group::Elements(members) => members.is_empty(),
            Group::Edges(members) => members.is_empty(),
            Group::Faces(members) => members.is_empty(),
        }
    }

    /// Returns the name of the members for messages about a mesh of the given shape.
    pub(crate) fn member_name(&self, shape: &Shape) -> &'static str {
        match self {
            Group::Points(_) => "points",
            Group::Edges(_) => "edges",
            Group::Faces(_) => "faces",
            Group::Elements(_) => shape.plural,
        }
    }
}

/// Mesh of triangles or tetrahedra.
///
/// # Units
/// For the muscle, coordinates are in meters.
///
/// # Examples
/// ```
/// use std::collections::BTreeMap;
/// use myovib_fem::mesh::{Group, Mesh};
/// let mesh = Mesh::new(
///     vec![[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]],
///     vec![[0, 1, 2]],
///     BTreeMap::from([("left".to_owned(), Group::Edges(vec![[0, 2]]))]),
/// )?;
/// assert_eq!((mesh.dimension(), mesh.measure()), (2, 1.0));
/// assert!(mesh.group("right").is_err());
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    shape: &'static Shape,
    /// Point coordinates, `dimension` values per point.
    coordinates: Vec<f64>,
    /// Vertex indices, `n_vertices` values per element.
    vertices: Vec<usize>,
    groups: BTreeMap<String, Group>,
    fields: BTreeMap<String, NodalField>,
    /// Midside nodes off the midpoint of their edge, keyed by the sorted ends of the edge.
    midside: BTreeMap<[usize; 2], [f64; 3]>,
    notes: Vec<MeshNote>,
}

impl Mesh {
    /// Creates a mesh of points with `D` coordinates and elements with `V = D + 1` vertices. Reorients inverted
    /// elements and drops repeated group members. [`notes`](Self::notes) reports these corrections.
    ///
    /// # Errors
    /// Returns an error for indices out of range, elements of zero measure, unused vertices, and group edges or
    /// faces that do not belong to an element. Returns [`FemError::Defect`] if elements overlap, or if they touch
    /// without sharing a whole edge (in 3D, face).
    ///
    /// # Panics
    /// Panics if `D` is not 2 or 3 or if `V` is not `D + 1`.
    pub fn new<const D: usize, const V: usize>(
        points: Vec<[f64; D]>,
        mut elements: Vec<[usize; V]>,
        groups: BTreeMap<String, Group>,
    ) -> Result<Self, FemError> {
        let shape = Shape::of_dimension(D);
        assert_eq!(V, shape.n_vertices(), "vertices of a {}", shape.name);
        if elements.is_empty() {
            return Err(FemError::NoElements { shape });
        }
        let mut used = vec![false; points.len()];
        let mut reoriented = Vec::new();
        for (element, vertices) in elements.iter_mut().enumerate() {
            for &vertex in vertices.iter() {
                check_index("vertex", vertex, points.len())?;
                used[vertex] = true;
            }
            if measure(&vertices.map(|v| points[v])) < 0.0 {
                vertices.swap(1, 2);
                reoriented.push(element);
            }
            let corners = vertices.map(|v| points[v]);
            if is_degenerate(&corners) {
                return Err(FemError::DegenerateElement {
                    element,
                    vertices: vertices.to_vec(),
                    measure: measure(&corners),
                    shape,
                });
            }
        }
        if let Some(vertex) = used.iter().position(|used| !used) {
            return Err(FemError::UnusedVertex { vertex, shape });
        }
        let mut mesh = Self {
            shape,
            coordinates: points.into_flattened(),
            vertices: elements.into_flattened(),
            groups: BTreeMap::new(),
            fields: BTreeMap::new(),
            midside: BTreeMap::new(),
            notes: Vec::new(),
        };
        conforming::conforming(D, &mesh.coordinates, &mesh.vertices, &reoriented)?;
        mesh.set_groups(groups)?;
        if !reoriented.is_empty() {
            mesh.notes.push(MeshNote::Reoriented {
                elements: reoriented.len(),
                order: shape.inverted_order,
            });
        }
        Ok(mesh)
    }

    /// Checks the groups, drops repeated members and stores the groups.
    fn set_groups(&mut self, mut groups: BTreeMap<String, Group>) -> Result<(), FemError> {
        self.check_groups(&groups)?;
        let mut notes = note::drop_repetitions(&mut groups, self.shape);
        self.notes.append(&mut notes);
        self.groups = groups;
        Ok(())
    }

    /// Returns the mesh with other groups.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new) that concern groups.
    pub fn with_groups(&self, groups: BTreeMap<String, Group>) -> Result<Self, FemError> {
        let mut mesh = self.clone();
        mesh.set_groups(groups)?;
        Ok(mesh)
    }

    fn check_groups(&self, groups: &BTreeMap<String, Group>) -> Result<(), FemError> {
        let edges: BTreeSet<[usize; 2]> = self.elements().flat_map(|e| self.edges_of(e)).collect();
        let faces: BTreeSet<[usize; 3]> = if self.dimension() == 3 {
            let sides = |e| self.shape.sides.iter().map(move |side| face(e, side));
            self.elements().flat_map(sides).collect()
        } else {
            BTreeSet::new()
        };
        for (name, group) in groups {
            let unknown = match group {
                Group::Points(vertices) => {
                    for &v in vertices {
                        check_index("vertex", v, self.n_points())?;
                    }
                    None
                }
                Group::Edges(members) => members
                    .iter()
                    .find(|edge| !edges.contains(&sorted(**edge)))
                    .map(|edge| edge.to_vec()),
                Group::Faces(members) => members
                    .iter()
                    .find(|face| !faces.contains(&sorted(**face)))
                    .map(|face| face.to_vec()),
                Group::Elements(members) => {
                    for &e in members {
                        check_index(self.shape.name, e, self.n_elements())?;
                    }
                    None
                }
            };
            if let Some(vertices) = unknown {
                return Err(FemError::UnknownFacet {
                    group: name.clone(),
                    vertices,
                    shape: self.shape,
                });
            }
        }
        Ok(())
    }

    /// Returns the shape of the elements.
    pub fn shape(&self) -> &'static Shape {
        self.shape
    }

    /// Returns the number of coordinates of a point: 2 for triangles, 3 for tetrahedra.
    pub fn dimension(&self) -> usize {
        self.shape.dimension
    }

    /// Returns notes on the corrections and omissions that were made while building the mesh.
    pub fn notes(&self) -> &[MeshNote] {
        &self.notes
    }

    /// Returns the mesh with the notes of its source mesh or file inserted before its own notes.
    pub(crate) fn with_earlier_notes(mut self, mut notes: Vec<MeshNote>) -> Self {
        notes.append(&mut self.notes);
        self.notes = notes;
        self
    }

    /// Returns the mesh with all coordinates multiplied by the positive number `factor`.
    pub fn scaled(mut self, factor: f64) -> Self {
        let midside = self.midside.values_mut().flatten();
        self.coordinates.iter_mut().chain(midside).for_each(|x| *x *= factor);
        self
    }

    /// Returns the coordinates of the vertices.
    pub fn points<const D: usize>(&self) -> &[[f64; D]] {
        points(&self.coordinates, self.dimension())
    }

    /// Returns the coordinates of all vertices, vertex by vertex.
    pub fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// Returns the number of vertices.
    pub fn n_points(&self) -> usize {
        self.coordinates.len() / self.dimension()
    }

    /// Returns the vertices of each element. The vertices of triangles are counterclockwise. The first three
    /// vertices of a tetrahedron are counterclockwise as seen from the side opposite to the fourth vertex.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = &[usize]> {
        self.vertices.chunks_exact(self.shape.n_vertices())
    }

    /// Returns the vertices of each element as arrays.
    ///
    /// # Panics
    /// Panics unless `V` is the number of vertices of an element.
    pub fn connectivity<const V: usize>(&self) -> &[[usize; V]] {
        assert_eq!(V, self.shape.n_vertices(), "vertices of a {}", self.shape.name);
        self.vertices.as_chunks().0
    }

    /// Returns the vertices of an element.
    pub fn element(&self, element: usize) -> &[usize] {
        let n = self.shape.n_vertices();
        &self.vertices[n * element..][..n]
    }

    /// Returns the number of elements.
    pub fn n_elements(&self) -> usize {
        self.vertices.len() / self.shape.n_vertices()
    }

    /// Returns the edges of an element as sorted pairs of vertices, in the order of the midpoint nodes.
    pub fn edges_of<'a>(&self, element: &'a [usize]) -> impl Iterator<Item = [usize; 2]> + use<'a> {
        let edges = self.shape.edges.iter();
        edges.map(|edge| sorted(edge.map(|i| element[i])))
    }

    /// Returns all groups, keyed by name.
    pub fn groups(&self) -> &BTreeMap<String, Group> {
        &self.groups
    }

    /// Returns the group with the given name.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist; the error lists the available groups.
    pub fn group(&self, name: &str) -> Result<&Group, FemError> {
        self.groups.get(name).ok_or_else(|| FemError::UnknownGroup {
            name: name.to_owned(),
            known: self.groups.keys().cloned().collect(),
        })
    }

    /// Returns the group with the given name. If several groups have this name, returns the group of the given
    /// dimension.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist.
    pub fn group_of_dimension(&self, name: &str, dimension: usize) -> Result<&Group, FemError> {
        let kind = msh::kind_of(dimension as u64);
        match self.groups.get(&format!("{kind} {name}")) {
            Some(group) if !self.groups.contains_key(name) => Ok(group),
            _ => self.group(name),
        }
    }

    /// Returns the edges of the group with the given name.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] if its members
    /// are of another kind.
    pub fn edges(&self, name: &str) -> Result<&[[usize; 2]], FemError> {
        match self.group(name)? {
            Group::Edges(edges) => Ok(edges),
            other => Err(self.wrong_group(name, other, "edges")),
        }
    }

    /// Returns the index of the connected part to which each element belongs. Elements of a part are connected
    /// through edges (in 3D, faces). Different parts may still share single vertices.
    pub fn parts(&self) -> Vec<usize> {
        parts::by_facets(self.dimension(), &self.coordinates, &self.vertices)
    }

    /// Returns the boundary facets of a group, which are edges of triangles or faces of tetrahedra.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] if its members
    /// are of another kind.
    pub fn facets(&self, name: &str) -> Result<Vec<&[usize]>, FemError> {
        let dimension = self.dimension();
        match (dimension, self.group_of_dimension(name, dimension - 1)?) {
            (2, Group::Edges(edges)) => Ok(edges.iter().map(|edge| &edge[..]).collect()),
            (3, Group::Faces(faces)) => Ok(faces.iter().map(|face| &face[..]).collect()),
            (2, other) => Err(self.wrong_group(name, other, "edges")),
            (_, other) => Err(self.wrong_group(name, other, "faces")),
        }
    }

    fn wrong_group(&self, name: &str, found: &Group, needed: &'static str) -> FemError {
        FemError::WrongGroup { name: name.to_owned(), found: found.member_name(self.shape), needed }
    }

    /// Returns the coordinates of the vertices of an element.
    ///
    /// # Panics
    /// Panics unless `D` is the dimension and `V` the number of vertices of an element.
    pub fn corners<const D: usize, const V: usize>(&self, element: usize) -> [[f64; D]; V] {
        let (points, vertices) = (self.points(), self.element(element));
        assert_eq!(V, vertices.len(), "vertices of a {}", self.shape.name);
        std::array::from_fn(|i| points[vertices[i]])
    }

    /// Returns the area or volume of an element.
    pub fn measure_of(&self, element: usize) -> f64 {
        match self.dimension() {
            2 => measure(&self.corners::<2, 3>(element)),
            _ => measure(&self.corners::<3, 4>(element)),
        }
    }

    /// Returns the total area or volume.
    pub fn measure(&self) -> f64 {
        (0..self.n_elements()).map(|e| self.measure_of(e)).sum()
    }
}

/// Views a flat array of coordinates as points.
pub(crate) fn points<const D: usize>(coordinates: &[f64], dimension: usize) -> &[[f64; D]] {
    assert_eq!(D, dimension, "the dimension of the mesh");
    coordinates.as_chunks().0
}

fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), FemError> {
    if index < count { Ok(()) } else { Err(FemError::OutOfRange { what, index, count }) }
}

/// Returns the signed measure of an element, which is negative if the element is inverted.
pub(crate) fn measure<const D: usize>(corners: &[[f64; D]]) -> f64 {
    Shape::of_dimension(D).reference_measure * inverse_map(corners).1
}

/// Returns whether the measure is zero up to rounding, or NaN.
pub(crate) fn is_degenerate<const D: usize>(corners: &[[f64; D]]) -> bool {
    let fine = measure(corners).abs() > DEGENERATE * longest_edge(corners).powi(D as i32);
    !fine
}

fn longest_edge<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let lengths =
        Shape::of_dimension(D).edges.iter().map(|&[a, b]| distance(corners[a], corners[b]));
    lengths.fold(0.0, f64::max)
}

/// Returns |a − b|.
pub(crate) fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| a - b);
    differences.reduce(f64::hypot).map_or(0.0, f64::abs)
}

/// Returns the vertices in ascending order, so that edges and faces can be compared.
pub(crate) fn sorted<const K: usize>(mut vertices: [usize; K]) -> [usize; K] {
    vertices.sort_unstable();
    vertices
}

/// Returns the sorted vertices of a side of a tetrahedron.
pub(crate) fn face(element: &[usize], side: &[usize]) -> [usize; 3] {
    sorted([element[side[0]], element[side[1]], element[side[2]]])
}

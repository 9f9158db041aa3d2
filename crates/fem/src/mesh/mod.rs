//! A mesh of triangles or tetrahedra with named groups.
//!
//! Owns points, elements and the physical groups by which scenes speak of parts of a mesh.
//! [`Mesh::new`] is the only way in, so every [`Mesh`] is valid: elements of positive measure that
//! share whole edges (in space: faces) and do not overlap, no loose vertices, group edges and faces
//! that are those of elements, each once. What it puts right it says in [`Mesh::notes`].
//!
//! The dimension is the mesh's own. Functions with a parameter `D` return points as arrays of that
//! many coordinates, and those with `V` the vertices of an element; they panic for a mesh of
//! another dimension.

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
mod simplices;

use std::collections::{BTreeMap, BTreeSet};

use crate::element::{Shape, inverse_map};
use crate::error::FemError;

pub use attributes::NodalField;
pub use defect::{DefectKind, ElementName, MeshDefect};
pub use note::{MeshNote, UnnamedGroup};

/// Measure below this fraction of the longest edge to the power of the dimension counts as zero: an
/// angle of 1e-12 rad, where a gradient keeps no more than four digits.
const DEGENERATE: f64 = 1e-12;

/// The members of a physical group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Group {
    /// Vertices.
    Points(Vec<usize>),
    /// Edges, by their two vertices: the sides of triangles, curves in space.
    Edges(Vec<[usize; 2]>),
    /// Faces of tetrahedra, by their three vertices.
    Faces(Vec<[usize; 3]>),
    /// Triangles or tetrahedra, by index.
    Elements(Vec<usize>),
}

impl Group {
    /// The word for the members in messages about a mesh of that shape.
    pub(crate) fn kind(&self, shape: &Shape) -> &'static str {
        match self {
            Group::Points(_) => "points",
            Group::Edges(_) => "edges",
            Group::Faces(_) => "faces",
            Group::Elements(_) => shape.plural,
        }
    }
}

/// A mesh of triangles or of tetrahedra.
///
/// # Units
/// Coordinates in metres, for the muscle.
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
/// assert!(mesh.group("right").unwrap_err().to_string().contains("left"));
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    shape: &'static Shape,
    /// As many for each point as there are dimensions.
    coordinates: Vec<f64>,
    /// As many for each element as it has vertices.
    vertices: Vec<usize>,
    groups: BTreeMap<String, Group>,
    /// Values at the vertices.
    fields: BTreeMap<String, NodalField>,
    /// Quadratic nodes that do not lie in the middle of their edge, by its sorted ends.
    bent: BTreeMap<[usize; 2], [f64; 3]>,
    notes: Vec<MeshNote>,
}

impl Mesh {
    /// Checks and keeps the parts of a mesh: points of `D` coordinates, elements of `V = D + 1`
    /// vertices. Mirrored elements are turned round, and what a group lists again is left out;
    /// [`notes`](Self::notes) says so.
    ///
    /// # Errors
    /// Indices out of range, elements of zero measure, vertices of no element, group edges or faces
    /// that are not those of an element; [`FemError::Defect`] for elements that overlap or that
    /// touch without sharing a whole edge (face).
    ///
    /// # Panics
    /// For dimensions other than 2 and 3, or another number of vertices.
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
        let mut turned = Vec::new();
        for (element, vertices) in elements.iter_mut().enumerate() {
            for &vertex in vertices.iter() {
                check_index("vertex", vertex, points.len())?;
                used[vertex] = true;
            }
            if measure(&vertices.map(|v| points[v])) < 0.0 {
                vertices.swap(1, 2);
                turned.push(element);
            }
            let corners = vertices.map(|v| points[v]);
            if is_degenerate(&corners) {
                return Err(FemError::Measure {
                    element,
                    vertices: vertices.to_vec(),
                    measure: measure(&corners),
                    shape,
                });
            }
        }
        if let Some(vertex) = used.iter().position(|used| !used) {
            return Err(FemError::LooseVertex { vertex, shape });
        }
        let mut mesh = Self {
            shape,
            coordinates: points.into_flattened(),
            vertices: elements.into_flattened(),
            groups: BTreeMap::new(),
            fields: BTreeMap::new(),
            bent: BTreeMap::new(),
            notes: Vec::new(),
        };
        conforming::conforming(D, &mesh.coordinates, &mesh.vertices, &turned)?;
        mesh.set_groups(groups)?;
        if !turned.is_empty() {
            mesh.notes.push(MeshNote::Turned {
                elements: turned.len(),
                how: shape.mirrored,
            });
        }
        Ok(mesh)
    }

    /// Checks groups, leaves out what they list again, and keeps them.
    fn set_groups(&mut self, mut groups: BTreeMap<String, Group>) -> Result<(), FemError> {
        self.check_groups(&groups)?;
        let mut notes = note::without_repetitions(&mut groups, self.shape);
        self.notes.append(&mut notes);
        self.groups = groups;
        Ok(())
    }

    /// The same points and elements with other groups.
    ///
    /// # Errors
    /// As for [`new`](Self::new), of the groups.
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
            let loose = match group {
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
            if let Some(vertices) = loose {
                return Err(FemError::LooseFacet {
                    group: name.clone(),
                    vertices,
                    shape: self.shape,
                });
            }
        }
        Ok(())
    }

    /// The shape of the elements.
    pub fn shape(&self) -> &'static Shape {
        self.shape
    }

    /// Number of coordinates of a point: 2 for triangles, 3 for tetrahedra.
    pub fn dimension(&self) -> usize {
        self.shape.dimension
    }

    /// What was put right or left aside.
    pub fn notes(&self) -> &[MeshNote] {
        &self.notes
    }

    /// The same mesh with these notes before its own: those of the mesh or file it was made from.
    pub(crate) fn after(mut self, mut notes: Vec<MeshNote>) -> Self {
        notes.append(&mut self.notes);
        self.notes = notes;
        self
    }

    /// The vertices.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub fn points<const D: usize>(&self) -> &[[f64; D]] {
        points(&self.coordinates, self.dimension())
    }

    /// The coordinates of all vertices, one vertex after the other.
    pub fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// Number of vertices.
    pub fn n_points(&self) -> usize {
        self.coordinates.len() / self.dimension()
    }

    /// The vertices of each element: triangles counter-clockwise, tetrahedra with the first three
    /// counter-clockwise seen from the fourth's other side.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = &[usize]> {
        self.vertices.chunks_exact(self.shape.n_vertices())
    }

    /// The vertices of each element, as arrays.
    ///
    /// # Panics
    /// Unless `V` is the number of vertices of an element.
    pub fn connectivity<const V: usize>(&self) -> &[[usize; V]] {
        assert_eq!(
            V,
            self.shape.n_vertices(),
            "vertices of a {}",
            self.shape.name
        );
        self.vertices.as_chunks().0
    }

    /// The vertices of an element.
    pub fn element(&self, element: usize) -> &[usize] {
        let n = self.shape.n_vertices();
        &self.vertices[n * element..][..n]
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.vertices.len() / self.shape.n_vertices()
    }

    /// The edges of an element, each sorted, in the order of the midpoint nodes.
    pub(crate) fn edges_of<'a>(
        &self,
        element: &'a [usize],
    ) -> impl Iterator<Item = [usize; 2]> + use<'a> {
        let edges = self.shape.edges.iter();
        edges.map(|edge| sorted(edge.map(|i| element[i])))
    }

    /// All groups, by name.
    pub fn groups(&self) -> &BTreeMap<String, Group> {
        &self.groups
    }

    /// The group of that name.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], which lists the groups there are.
    pub fn group(&self, name: &str) -> Result<&Group, FemError> {
        self.groups.get(name).ok_or_else(|| FemError::UnknownGroup {
            name: name.to_owned(),
            known: self.groups.keys().cloned().collect(),
            unnamed: self.unnamed().cloned().collect(),
        })
    }

    /// The physical groups of the mesh file that have no name.
    fn unnamed(&self) -> impl Iterator<Item = &UnnamedGroup> {
        self.notes.iter().filter_map(|note| match note {
            MeshNote::Unnamed(group) => Some(group),
            _ => None,
        })
    }

    /// The edges of the group of that name.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], or [`FemError::WrongGroup`] if it holds something else.
    pub fn edges(&self, name: &str) -> Result<&[[usize; 2]], FemError> {
        match self.group(name)? {
            Group::Edges(edges) => Ok(edges),
            other => Err(self.wrong_group(name, other, "edges")),
        }
    }

    /// The part of the mesh that each element belongs to: elements of a part share edges (in space:
    /// faces). Parts may still share single vertices.
    pub fn parts(&self) -> Vec<usize> {
        parts::by_facets(self.dimension(), &self.coordinates, &self.vertices)
    }

    /// The members of the group of that name as parts of the boundary: edges of triangles, faces of
    /// tetrahedra.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], or [`FemError::WrongGroup`] if it holds something else.
    pub fn facets(&self, name: &str) -> Result<Vec<&[usize]>, FemError> {
        match (self.dimension(), self.group(name)?) {
            (2, Group::Edges(edges)) => Ok(edges.iter().map(|edge| &edge[..]).collect()),
            (3, Group::Faces(faces)) => Ok(faces.iter().map(|face| &face[..]).collect()),
            (2, other) => Err(self.wrong_group(name, other, "edges")),
            (_, other) => Err(self.wrong_group(name, other, "faces")),
        }
    }

    fn wrong_group(&self, name: &str, found: &Group, needed: &'static str) -> FemError {
        FemError::WrongGroup {
            name: name.to_owned(),
            found: found.kind(self.shape),
            needed,
        }
    }

    /// The places of the vertices of an element.
    ///
    /// # Panics
    /// Unless `D` is the dimension and `V` the number of vertices.
    pub fn corners<const D: usize, const V: usize>(&self, element: usize) -> [[f64; D]; V] {
        let (points, vertices) = (self.points(), self.element(element));
        assert_eq!(V, vertices.len(), "vertices of a {}", self.shape.name);
        std::array::from_fn(|i| points[vertices[i]])
    }

    /// The area or volume of an element.
    pub fn measure_of(&self, element: usize) -> f64 {
        match self.dimension() {
            2 => measure(&self.corners::<2, 3>(element)),
            _ => measure(&self.corners::<3, 4>(element)),
        }
    }

    /// The total area or volume.
    pub fn measure(&self) -> f64 {
        (0..self.n_elements()).map(|e| self.measure_of(e)).sum()
    }

    /// The length of the longest edge, the h of convergence orders.
    pub fn h_max(&self) -> f64 {
        let longest = |element| match self.dimension() {
            2 => longest_edge(&self.corners::<2, 3>(element)),
            _ => longest_edge(&self.corners::<3, 4>(element)),
        };
        (0..self.n_elements()).map(longest).fold(0.0, f64::max)
    }
}

/// Coordinates as points.
pub(crate) fn points<const D: usize>(coordinates: &[f64], dimension: usize) -> &[[f64; D]] {
    assert_eq!(D, dimension, "the dimension of the mesh");
    coordinates.as_chunks().0
}

fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), FemError> {
    if index < count {
        Ok(())
    } else {
        Err(FemError::OutOfRange { what, index, count })
    }
}

/// The measure of an element, negative if it is mirrored.
pub(crate) fn measure<const D: usize>(corners: &[[f64; D]]) -> f64 {
    Shape::of_dimension(D).reference_measure * inverse_map(corners).1
}

/// Whether the measure is not safely away from zero (or not a number).
pub(crate) fn is_degenerate<const D: usize>(corners: &[[f64; D]]) -> bool {
    let fine = measure(corners).abs() > DEGENERATE * longest_edge(corners).powi(D as i32);
    !fine
}

fn longest_edge<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let lengths = Shape::of_dimension(D)
        .edges
        .iter()
        .map(|&[a, b]| distance(corners[a], corners[b]));
    lengths.fold(0.0, f64::max)
}

/// |a − b|.
pub(crate) fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| a - b);
    differences.reduce(f64::hypot).map_or(0.0, f64::abs)
}

/// Vertices in ascending order, the form in which edges and faces are compared.
pub(crate) fn sorted<const K: usize>(mut vertices: [usize; K]) -> [usize; K] {
    vertices.sort_unstable();
    vertices
}

/// A side of a tetrahedron, sorted.
pub(crate) fn face(element: &[usize], side: &[usize]) -> [usize; 3] {
    sorted([element[side[0]], element[side[1]], element[side[2]]])
}

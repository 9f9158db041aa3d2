//! A plane triangle mesh with named groups.
//!
//! Owns points, triangles and the physical groups by which scenes speak of parts of a mesh.
//! [`Mesh::new`] is the only way in, so every [`Mesh`] is valid: counter-clockwise triangles of
//! positive area that share whole edges and do not overlap, no loose vertices, group edges that are
//! edges of triangles, each once. What it puts right it says in [`Mesh::notes`].

mod boxes;
mod conforming;
mod defect;
mod facets;
mod note;
mod simplices;

use std::collections::{BTreeMap, BTreeSet};

use crate::error::FemError;

pub use defect::{DefectKind, ElementName, MeshDefect};
pub use note::{MeshNote, UnnamedGroup};

/// Area below this fraction of the squared longest edge counts as zero: an angle of 1e-12 rad,
/// where a gradient keeps no more than four digits.
const DEGENERATE: f64 = 1e-12;

/// The members of a physical group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Group {
    /// Vertices.
    Points(Vec<usize>),
    /// Edges, by their two vertices.
    Edges(Vec<[usize; 2]>),
    /// Triangles, by index.
    Triangles(Vec<usize>),
}

impl Group {
    /// The word for the members in messages.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Group::Points(_) => "points",
            Group::Edges(_) => "edges",
            Group::Triangles(_) => "triangles",
        }
    }
}

/// A plane triangle mesh.
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
/// assert_eq!(mesh.area(), 1.0);
/// assert!(mesh.group("right").unwrap_err().to_string().contains("left"));
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    points: Vec<[f64; 2]>,
    triangles: Vec<[usize; 3]>,
    groups: BTreeMap<String, Group>,
    notes: Vec<MeshNote>,
}

impl Mesh {
    /// Checks and keeps the parts of a mesh. Clockwise triangles are turned round, and what a group
    /// lists again is left out; [`notes`](Self::notes) says so.
    ///
    /// # Errors
    /// Indices out of range, triangles of zero area, vertices of no triangle, group edges that are
    /// not edges of a triangle; [`FemError::Defect`] for triangles that overlap or that touch
    /// without sharing a whole edge.
    pub fn new(
        points: Vec<[f64; 2]>,
        mut triangles: Vec<[usize; 3]>,
        mut groups: BTreeMap<String, Group>,
    ) -> Result<Self, FemError> {
        if triangles.is_empty() {
            return Err(FemError::NoTriangles);
        }
        let mut used = vec![false; points.len()];
        let mut turned = Vec::new();
        for (element, corners) in triangles.iter_mut().enumerate() {
            for &vertex in corners.iter() {
                check_index("vertex", vertex, points.len())?;
                used[vertex] = true;
            }
            if signed_area(corners.map(|v| points[v])) < 0.0 {
                corners.swap(1, 2);
                turned.push(element);
            }
            let places = corners.map(|v| points[v]);
            if is_degenerate(places) {
                return Err(FemError::Area {
                    element,
                    vertices: *corners,
                    area: signed_area(places),
                });
            }
        }
        if let Some(vertex) = used.iter().position(|used| !used) {
            return Err(FemError::LooseVertex { vertex });
        }
        let edges: BTreeSet<[usize; 2]> = triangles.iter().flat_map(triangle_edges).collect();
        for (name, group) in &groups {
            match group {
                Group::Points(vertices) => {
                    for &v in vertices {
                        check_index("vertex", v, points.len())?;
                    }
                }
                Group::Edges(members) => {
                    if let Some(&edge) = members.iter().find(|e| !edges.contains(&sorted(**e))) {
                        return Err(FemError::LooseEdge {
                            group: name.clone(),
                            edge,
                        });
                    }
                }
                Group::Triangles(members) => {
                    for &e in members {
                        check_index("triangle", e, triangles.len())?;
                    }
                }
            }
        }
        conforming::conforming(2, points.as_flattened(), triangles.as_flattened(), &turned)?;
        let mut notes = note::without_repetitions(&mut groups);
        if !turned.is_empty() {
            notes.push(MeshNote::Turned {
                elements: turned.len(),
            });
        }
        Ok(Self {
            points,
            triangles,
            groups,
            notes,
        })
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

    /// The same points and triangles with other groups.
    ///
    /// # Errors
    /// As for [`new`](Self::new), of the groups.
    pub fn with_groups(&self, groups: BTreeMap<String, Group>) -> Result<Self, FemError> {
        let mesh = Self::new(self.points.clone(), self.triangles.clone(), groups)?;
        Ok(mesh.after(self.notes.clone()))
    }

    /// The vertices.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The triangles, counter-clockwise.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
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
            other => Err(FemError::WrongGroup {
                name: name.to_owned(),
                found: other.kind(),
                needed: "edges",
            }),
        }
    }

    /// The corners of triangle `element`.
    pub fn corners(&self, element: usize) -> [[f64; 2]; 3] {
        self.triangles[element].map(|v| self.points[v])
    }

    /// The area of triangle `element`.
    pub fn area_of(&self, element: usize) -> f64 {
        signed_area(self.corners(element))
    }

    /// The total area.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|e| signed_area(self.corners(e)))
            .sum()
    }

    /// The length of the longest edge, the h of convergence orders.
    pub fn h_max(&self) -> f64 {
        (0..self.triangles.len())
            .map(|e| longest_edge(self.corners(e)))
            .fold(0.0, f64::max)
    }
}

fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), FemError> {
    if index < count {
        Ok(())
    } else {
        Err(FemError::OutOfRange { what, index, count })
    }
}

/// The area of a triangle, negative if its corners run clockwise.
pub(crate) fn signed_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))
}

/// Whether the area is not safely away from zero (or not a number).
pub(crate) fn is_degenerate(corners: [[f64; 2]; 3]) -> bool {
    let fine = signed_area(corners).abs() > DEGENERATE * longest_edge(corners).powi(2);
    !fine
}

fn longest_edge([a, b, c]: [[f64; 2]; 3]) -> f64 {
    let length = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
    length(a, b).max(length(b, c)).max(length(c, a))
}

/// An edge with its vertices in ascending order, the form in which edges are compared.
pub(crate) fn sorted([a, b]: [usize; 2]) -> [usize; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// The edges of a triangle, each sorted, in the order of the midside nodes.
pub(crate) fn triangle_edges(&[a, b, c]: &[usize; 3]) -> [[usize; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(sorted)
}

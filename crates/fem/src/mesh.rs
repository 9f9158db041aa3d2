//! A plane triangle mesh with named groups.
//!
//! Owns points, triangles and the physical groups by which scenes speak of parts of a mesh.
//! [`Mesh::new`] is the only way in, so every [`Mesh`] is valid: counter-clockwise triangles of
//! positive area, no loose vertices, group edges that are edges of triangles.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::FemError;

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
}

impl Mesh {
    /// Checks and keeps the parts of a mesh.
    ///
    /// # Errors
    /// Indices out of range, triangles of zero or negative area, vertices of no triangle, group
    /// edges that are not edges of a triangle.
    pub fn new(
        points: Vec<[f64; 2]>,
        triangles: Vec<[usize; 3]>,
        groups: BTreeMap<String, Group>,
    ) -> Result<Self, FemError> {
        if triangles.is_empty() {
            return Err(FemError::NoTriangles);
        }
        let mut used = vec![false; points.len()];
        for (element, corners) in triangles.iter().enumerate() {
            for &vertex in corners {
                check_index("vertex", vertex, points.len())?;
                used[vertex] = true;
            }
            if let Some(area) = bad_area(corners.map(|v| points[v])) {
                return Err(FemError::Area {
                    element,
                    vertices: *corners,
                    area,
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
        Ok(Self {
            points,
            triangles,
            groups,
        })
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

/// The area if it is not safely positive (or not a number).
pub(crate) fn bad_area(corners: [[f64; 2]; 3]) -> Option<f64> {
    let area = signed_area(corners);
    let fine = area > DEGENERATE * longest_edge(corners).powi(2);
    (!fine).then_some(area)
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

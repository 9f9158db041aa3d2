//! Notes on corrections and omissions made while building a mesh.

use std::collections::{BTreeMap, HashSet};
use std::fmt;
use std::hash::Hash;

use super::curved::NEARLY_DEGENERATE;
use super::defect::coordinates;
use super::{Group, sorted};
use crate::element::Shape;

/// Note on a correction or omission.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum MeshNote {
    /// Elements of negative measure were reoriented.
    Reoriented {
        elements: usize,
        /// Name of the original vertex order of the elements.
        order: &'static str,
    },
    /// A group listed some members repeatedly, possibly with an edge in both directions. Each member counts once.
    Repeated {
        group: String,
        /// Number of dropped entries.
        entries: usize,
        /// Name of the members of the group.
        kind: &'static str,
    },
    /// The mesh is in a plane other than z = 0. The two axes of this plane are renamed x and y.
    Plane {
        /// Original axes in the file.
        axes: [char; 2],
    },
    /// A nodal field has values at nodes other than vertices. Only the values at vertices are used.
    OffVertexValues {
        field: String,
        /// Number of dropped values.
        values: usize,
    },
    /// Curved elements are nearly degenerate: the determinant of their map is below a fifth of its value in the
    /// straight element.
    NearlyDegenerate {
        elements: usize,
        /// Smallest ratio of the two determinants.
        ratio: f64,
        /// Position of the smallest ratio, with as many coordinates as the mesh has dimensions.
        near: Vec<f64>,
    },
}

impl fmt::Display for MeshNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reoriented { elements, order } => write!(
                f,
                "{elements} elements of the mesh had {order} vertex order and were reoriented"
            ),
            Self::Repeated { group, entries, kind } => write!(
                f,
                "group \"{group}\" lists {kind} more than once: {entries} repeated entries were ignored"
            ),
            Self::Plane { axes: [a, b] } => {
                write!(f, "the mesh is plane: its axes {a} and {b} are called x and y")
            }
            Self::OffVertexValues { field, values } => write!(
                f,
                "field \"{field}\" is interpolated linearly from the vertices: values at {values} other nodes were ignored"
            ),
            Self::NearlyDegenerate { elements, ratio, near } => write!(
                f,
                "{elements} curved elements are nearly degenerate: near ({}) the Jacobian determinant is {ratio:.2} of \
                 its value in the straight element (limit {NEARLY_DEGENERATE}), where solutions are inaccurate and loads may invert \
                 the element; optimize the mesh (Gmsh: `Mesh.OptimizeNetgen = 1`), refine it at curved boundaries, or move \
                 the nodes on the edges toward the midpoints",
                coordinates(near)
            ),
        }
    }
}

/// Drops repeated members of groups and returns a note for each group with repeated members.
pub(super) fn drop_repetitions(
    groups: &mut BTreeMap<String, Group>,
    shape: &Shape,
) -> Vec<MeshNote> {
    let mut notes = Vec::new();
    for (name, group) in groups {
        let entries = match group {
            Group::Points(members) => keep_first(members, |v| *v),
            Group::Edges(members) => keep_first(members, |e| sorted(*e)),
            Group::Faces(members) => keep_first(members, |f| sorted(*f)),
            Group::Elements(members) => keep_first(members, |e| *e),
        };
        if entries > 0 {
            notes.push(MeshNote::Repeated {
                group: name.clone(),
                entries,
                kind: group.member_name(shape),
            });
        }
    }
    notes
}

/// Keeps the first member for each key, and returns the number of dropped members.
fn keep_first<T, K: Eq + Hash>(members: &mut Vec<T>, key: impl Fn(&T) -> K) -> usize {
    let before = members.len();
    let mut seen = HashSet::with_capacity(before);
    members.retain(|member| seen.insert(key(member)));
    before - members.len()
}

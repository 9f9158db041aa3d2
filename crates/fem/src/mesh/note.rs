//! What was put right in a mesh, or left aside, without being asked.

use std::collections::{BTreeMap, HashSet};
use std::fmt;
use std::hash::Hash;

use super::{Group, sorted};
use crate::element::Shape;

/// A word on a mesh that is right now.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshNote {
    /// Elements of negative measure were turned round.
    Turned {
        /// How many.
        elements: usize,
        /// What was wrong with them.
        how: &'static str,
    },
    /// A group listed members more than once (an edge also the other way round); they count once.
    Repeated {
        /// The group.
        group: String,
        /// How many entries were left out.
        entries: usize,
        /// What its members are.
        kind: &'static str,
    },
    /// The mesh file has a physical group without a name, which no scene can speak of.
    Unnamed(UnnamedGroup),
    /// A nodal field has values at nodes that are no vertices; those at the vertices are interpolated.
    BesideVertices {
        /// The field.
        field: String,
        /// How many values were left out.
        values: usize,
    },
}

/// A physical group of a mesh file that has no name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnnamedGroup {
    /// Dimension of its members.
    pub dimension: u64,
    /// Its physical tag.
    pub tag: i64,
    /// How many elements it has.
    pub elements: usize,
}

impl UnnamedGroup {
    /// Gmsh's word for groups of that dimension.
    fn word(&self) -> &'static str {
        match self.dimension {
            0 => "Point",
            1 => "Curve",
            2 => "Surface",
            _ => "Volume",
        }
    }

    /// The line of a Gmsh script that gives it a name.
    pub fn named(&self, name: &str) -> String {
        format!("Physical {}(\"{name}\", {}) = {{…}}", self.word(), self.tag)
    }
}

impl fmt::Display for UnnamedGroup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tag, elements, .. } = self;
        let word = self.word();
        write!(
            f,
            "Physical {word} {tag} ({elements} elements, dimension {})",
            self.dimension
        )
    }
}

impl fmt::Display for MeshNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Turned { elements, how } => write!(
                f,
                "elements of the mesh {how} and were turned round: {elements}"
            ),
            Self::Repeated {
                group,
                entries,
                kind,
            } => write!(
                f,
                "group \"{group}\" lists {kind} more than once: {entries} repeated entries were left out"
            ),
            Self::BesideVertices { field, values } => write!(
                f,
                "field \"{field}\" is taken from the vertices, linear between them: values at {values} other nodes \
                 were left out"
            ),
            Self::Unnamed(group) => write!(
                f,
                "{group} has no name, so that no scene can speak of it: in Gmsh write {}",
                group.named("name")
            ),
        }
    }
}

/// Leaves out what groups list again, with a word for each such group.
pub(super) fn without_repetitions(
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
                kind: group.kind(shape),
            });
        }
    }
    notes
}

/// Keeps the first of the members with the same key; how many went.
fn keep_first<T, K: Eq + Hash>(members: &mut Vec<T>, key: impl Fn(&T) -> K) -> usize {
    let before = members.len();
    let mut seen = HashSet::with_capacity(before);
    members.retain(|member| seen.insert(key(member)));
    before - members.len()
}

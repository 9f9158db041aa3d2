//! What makes a set of elements no mesh of a body.

use std::fmt;

/// An element in messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementName {
    /// Its index, from 0.
    Index(usize),
    /// Its tag in the mesh file.
    Tag(u64),
}

impl fmt::Display for ElementName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Index(index) => write!(f, "number {index}"),
            Self::Tag(tag) => write!(f, "{tag}"),
        }
    }
}

/// Elements that do not fit together, or one that its curved edges turn inside out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}, near ({}), {}", names(elements), place(near), self.complaint())]
pub struct MeshDefect {
    /// How.
    pub kind: DefectKind,
    /// Which.
    pub elements: Vec<ElementName>,
    /// Where, near enough to find it: as many coordinates as the mesh has.
    pub near: Vec<f64>,
}

/// How elements can fail to be parts of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DefectKind {
    /// Two have the same vertices.
    Twice,
    /// More than two share an edge (in space: a face).
    Crowded,
    /// Two that share an edge (a face) lie on the same side of it; the second one is inverted where
    /// its vertices ran the other way round.
    SameSide {
        /// Whether the second one's did.
        inverted: bool,
    },
    /// They touch along edges (faces) of the same place that have vertices of their own.
    Crack,
    /// They touch along parts of edges (faces).
    Hanging,
    /// They cover the same place.
    Overlap,
    /// The map of a curved one has no positive determinant at that place.
    Folded,
}

impl MeshDefect {
    /// What is wrong with the elements.
    fn complaint(&self) -> String {
        let (facet, a_facet) = match self.near.len() {
            2 => ("edge", "an edge"),
            _ => ("face", "a face"),
        };
        match self.kind {
            DefectKind::Twice => "have the same vertices: delete one of them".to_owned(),
            DefectKind::Crowded => {
                format!("share one {facet}: two elements at most can have {a_facet} in common")
            }
            DefectKind::SameSide { inverted: false } => {
                format!("overlap: they lie on the same side of the {facet} they share")
            }
            DefectKind::SameSide { inverted: true } => {
                format!("lie on the same side of the {facet} they share: the last one is inverted")
            }
            DefectKind::Crack => format!(
                "touch at {a_facet} without sharing it, a crack: merge the duplicate nodes \
                 (Gmsh: Coherence Mesh), or leave a gap"
            ),
            DefectKind::Hanging => format!(
                "touch at a part of {a_facet} only, where a node hangs: let neighbours share \
                 whole {facet}s (Gmsh: BooleanFragments before meshing), or leave a gap"
            ),
            DefectKind::Overlap => "overlap".to_owned(),
            DefectKind::Folded => "is turned inside out there by the nodes on its curved edges: \
                 move them towards the middles (Gmsh: Mesh.HighOrderOptimize = 2), or refine the mesh"
                .to_owned(),
        }
    }
}

fn names(elements: &[ElementName]) -> String {
    let names: Vec<String> = elements.iter().map(ToString::to_string).collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => {
            format!("elements {} and {last}", rest.join(", "))
        }
        _ => format!("element {}", names.concat()),
    }
}

fn place(near: &[f64]) -> String {
    let coordinates: Vec<String> = near.iter().map(|x| format!("{x:.6}")).collect();
    coordinates.join(", ")
}

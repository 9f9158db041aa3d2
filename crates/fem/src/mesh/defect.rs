//! Mesh defects: reasons why elements do not form a conforming mesh.

use std::fmt;

/// Name of an element in messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementName {
    /// Zero-based index of the element.
    Index(usize),
    /// Tag of the element in the mesh file.
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

/// Nonconforming elements, or an inverted curved element.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}, near ({}), {}", names(elements), coordinates(near), self.reason())]
pub struct MeshDefect {
    /// Kind of the defect.
    pub kind: DefectKind,
    /// Elements that have the defect.
    pub elements: Vec<ElementName>,
    /// Approximate position of the defect, with as many coordinates as the mesh has dimensions.
    pub near: Vec<f64>,
}

/// Kind of a mesh defect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DefectKind {
    /// Two elements have the same vertices.
    Duplicate,
    /// More than two elements share an edge (in 3D, a face).
    NonManifold,
    /// Two elements are on the same side of their shared edge (in 3D, face).
    SameSide {
        /// Whether the vertex order of the second element was inverted.
        inverted: bool,
    },
    /// Elements touch along coincident edges (in 3D, faces) with duplicate vertices.
    Crack,
    /// Elements touch along parts of edges (in 3D, faces), so there is a hanging node.
    HangingNode,
    /// Elements overlap.
    Overlap,
    /// The map of a curved element has a non-positive determinant.
    InvertedCurved,
}

impl MeshDefect {
    fn reason(&self) -> String {
        let (facet, a_facet) = match self.near.len() {
            2 => ("edge", "an edge"),
            _ => ("face", "a face"),
        };
        match self.kind {
            DefectKind::Duplicate => "have the same vertices: delete all but the first".to_owned(),
            DefectKind::NonManifold => {
                format!("share one {facet}: at most two elements can share {a_facet}")
            }
            DefectKind::SameSide { inverted: false } => {
                format!("overlap: they lie on the same side of the {facet} they share")
            }
            DefectKind::SameSide { inverted: true } => {
                format!("lie on the same side of the {facet} they share: the last element is inverted")
            }
            DefectKind::Crack => format!(
                "touch at {a_facet} but do not share its nodes (a crack): merge the duplicate nodes (Gmsh: Coherence \
                 Mesh, or BooleanFragments before meshing if the two meshes do not match), or leave a gap"
            ),
            DefectKind::HangingNode => format!(
                "touch along part of {a_facet}, at a hanging node: make neighbors share \
                 whole {facet}s (Gmsh: BooleanFragments before meshing), or leave a gap"
            ),
            DefectKind::Overlap => "overlap".to_owned(),
            DefectKind::InvertedCurved => "is inverted there by the nodes on its curved edges: \
                 move them toward the edge midpoints (Gmsh: Mesh.HighOrderOptimize = 2), or refine the mesh"
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

pub(super) fn coordinates(near: &[f64]) -> String {
    let coordinates: Vec<String> = near.iter().map(|x| format!("{x:.6}")).collect();
    coordinates.join(", ")
}

//! What can go wrong before a computation starts: files, meshes, groups, data of the wrong size.

use std::path::PathBuf;

use crate::element::Shape;
use crate::mesh::defect::{ElementName, MeshDefect};
use crate::mesh::note::UnnamedGroup;

/// An error of this crate's set-up routines.
///
/// The element loops have an error type of their own, [`Inverted`](crate::solid::Inverted),
/// because an integrator recovers from it.
#[derive(Debug, thiserror::Error)]
pub enum FemError {
    /// The mesh file could not be read.
    #[error("cannot read mesh {}: {source}", path.display())]
    Io {
        /// The file asked for.
        path: PathBuf,
        /// Why the system refused.
        source: std::io::Error,
    },
    /// The text is not a mesh file this crate reads.
    #[error("{file}, line {line}: {problem}")]
    Msh {
        /// Name of the file, as given.
        file: String,
        /// Line number, from 1.
        line: usize,
        /// What is wrong there.
        problem: MshProblem,
    },
    /// A physical group that the mesh does not have.
    #[error(
        "the mesh has no group \"{name}\"; its groups are: {}{}",
        list(known),
        to_be_named(name, unnamed)
    )]
    UnknownGroup {
        /// The group asked for.
        name: String,
        /// The groups there are.
        known: Vec<String>,
        /// Those that the mesh file does not name.
        unnamed: Vec<UnnamedGroup>,
    },
    /// A nodal field that the mesh does not have.
    #[error(
        "the mesh has no nodal field \"{name}\"; its fields are: {}",
        list(known)
    )]
    UnknownField {
        /// The field asked for.
        name: String,
        /// The fields there are.
        known: Vec<String>,
    },
    /// A group of points where edges are needed, or the like.
    #[error("group \"{name}\" holds {found}, but {needed} are needed")]
    WrongGroup {
        /// The group.
        name: String,
        /// What it holds.
        found: &'static str,
        /// What the operation needs.
        needed: &'static str,
    },
    /// Elements that do not fit together.
    #[error(transparent)]
    Defect(#[from] MeshDefect),
    /// An element of zero measure.
    #[error(
        "element {element} (vertices {vertices:?}) has {} {measure:e}: it is degenerate",
        shape.measure_name
    )]
    Measure {
        /// Index of the element.
        element: usize,
        /// Its vertices.
        vertices: Vec<usize>,
        /// Its signed area or volume.
        measure: f64,
        /// What it is.
        shape: &'static Shape,
    },
    /// A mesh without elements.
    #[error("the mesh has no {}", shape.plural)]
    NoElements {
        /// What there should be.
        shape: &'static Shape,
    },
    /// An operation of one dimension on a mesh of another.
    #[error("the mesh has {found} dimensions, {needed} are needed")]
    Dimension {
        /// That of the mesh.
        found: usize,
        /// That of the operation.
        needed: usize,
    },
    /// A pressure of elements of different bulk modulus or damping.
    #[error(
        "elements of different kappa or beta have the pressure at vertex {vertex} in common: give \
         each region pressures of its own (Space::with_regions)"
    )]
    SharedPressure {
        /// The vertex.
        vertex: usize,
    },
    /// An element that is given two stresses beside that of its law.
    #[error(
        "element {element} is in two regions with active or viscous stress: give it one region \
         that has both"
    )]
    TwoAdded {
        /// The element.
        element: usize,
    },
    /// Active or viscous stress of finite strains in an element with a law of small strains.
    #[error(
        "element {element} has a law of small strains, which takes no active or viscous stress: \
         choose a law of finite strains there, or Rayleigh damping"
    )]
    AddedToSmallStrain {
        /// The element.
        element: usize,
    },
    /// An index that points outside the mesh.
    #[error("{what} {index} is out of range: there are {count}")]
    OutOfRange {
        /// What the index counts.
        what: &'static str,
        /// The index.
        index: usize,
        /// One more than the largest allowed.
        count: usize,
    },
    /// A vertex that belongs to no element.
    #[error("vertex {vertex} belongs to no {}", shape.name)]
    LooseVertex {
        /// The vertex.
        vertex: usize,
        /// What it should belong to.
        shape: &'static Shape,
    },
    /// A group's edge or face that is not one of any element.
    #[error("{} of group \"{group}\" is not one of any {}", facet(vertices), shape.name)]
    LooseFacet {
        /// The group.
        group: String,
        /// Its vertices.
        vertices: Vec<usize>,
        /// What it should belong to.
        shape: &'static Shape,
    },
    /// An edge or face that is to be part of the boundary, but has an element on either side.
    #[error("{} of group \"{group}\" lies inside the body", facet(vertices))]
    InnerFacet {
        /// The group.
        group: String,
        /// Its vertices.
        vertices: Vec<usize>,
    },
    /// A part of the boundary that is to enclose a volume, but is in several pieces.
    #[error(
        "group \"{group}\" is in {found} separate pieces, which do not say what they enclose: each needs a group \
         of its own"
    )]
    Pieces {
        /// The group.
        group: String,
        /// The number of pieces.
        found: usize,
    },
    /// A list that does not have one entry for each of something.
    #[error("{what}: {found} given, {needed} needed")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many were given.
        found: usize,
        /// How many there should be.
        needed: usize,
    },
    /// A material law that there is not.
    #[error("there is no law \"{name}\"; the laws are: {}", known.join(", "))]
    UnknownLaw {
        /// The name asked for.
        name: String,
        /// The laws there are.
        known: Vec<&'static str>,
    },
    /// A constant that a law does not have.
    #[error("the law {law} has no constant \"{name}\"; it has: {}", known.join(", "))]
    UnknownConstant {
        /// The law.
        law: &'static str,
        /// The name given.
        name: String,
        /// The constants there are.
        known: Vec<&'static str>,
    },
    /// A constant of a law that was not given.
    #[error("the law {law} needs {name}{}", in_unit(unit))]
    MissingConstant {
        /// The law.
        law: &'static str,
        /// The constant.
        name: &'static str,
        /// Its unit; empty for a pure number.
        unit: &'static str,
    },
    /// A vector of a field of a mesh that is no direction.
    #[error(
        "the field \"{field}\" is {problem} at node {node}: ({}, {}, {})",
        vector[0], vector[1], vector[2]
    )]
    Direction {
        /// The field.
        field: String,
        /// The node's tag.
        node: u64,
        /// The vector.
        vector: [f64; 3],
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A parameter outside its range.
    #[error("{name} = {value} must be {condition}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is required of it.
        condition: &'static str,
    },
}

impl FemError {
    /// The same with elements called by their tags, those of a mesh file in its order.
    pub(crate) fn with_tags(mut self, tags: &[u64]) -> Self {
        if let Self::Defect(defect) = &mut self {
            for name in &mut defect.elements {
                if let ElementName::Index(index) = *name {
                    *name = ElementName::Tag(tags[index]);
                }
            }
        }
        self
    }
}

/// A word on groups that would have to be named before a scene can speak of them.
fn to_be_named(wanted: &str, unnamed: &[UnnamedGroup]) -> String {
    let Some(first) = unnamed.first() else {
        return String::new();
    };
    let groups: Vec<String> = unnamed.iter().map(ToString::to_string).collect();
    format!(
        "; without a name it has {}: name the one you mean, in Gmsh {}",
        groups.join(", "),
        first.named(wanted)
    )
}

/// An edge or face by its vertices.
fn facet(vertices: &[usize]) -> String {
    let numbers: Vec<String> = vertices.iter().map(usize::to_string).collect();
    let kind = if vertices.len() == 2 { "edge" } else { "face" };
    format!("{kind} ({})", numbers.join(", "))
}

fn in_unit(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" (in {unit})")
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        "(none)".to_owned()
    } else {
        names.join(", ")
    }
}

/// What is wrong with a line of a mesh file.
#[derive(Debug, thiserror::Error)]
pub enum MshProblem {
    /// Another version of the format.
    #[error(
        "MSH version {0} is not read, only 4.1: in Gmsh export with \
         File > Export > \"Version 4 ASCII\", or `gmsh -2 -format msh41 FILE.geo`"
    )]
    Version(String),
    /// The binary form of the format.
    #[error(
        "binary MSH is not read, only ASCII: in Gmsh export with \
         File > Export > \"Version 4 ASCII\", or set `Mesh.Binary = 0`"
    )]
    Binary,
    /// The text does not start like a mesh file.
    #[error("this is not a Gmsh mesh: it must start with $MeshFormat")]
    NotMsh,
    /// The text ended too early.
    #[error("the file ends where {0} should follow")]
    Truncated(&'static str),
    /// A word that is not what should stand there.
    #[error("expected {expected}, found \"{found}\"")]
    Expected {
        /// What should stand there.
        expected: &'static str,
        /// What does.
        found: String,
    },
    /// A tag defined twice.
    #[error("{what} {tag} is defined twice")]
    Duplicate {
        /// Node, group, ….
        what: &'static str,
        /// Its tag or name.
        tag: String,
    },
    /// A reference to a node that the file does not define before.
    #[error("node {0} is not defined")]
    UnknownNode(u64),
    /// A node of a physical group that no element of the body has.
    #[error("node {0} of a physical group is not a node of any element of the body")]
    LooseNode(u64),
    /// An element type that is not read.
    #[error(
        "element type {0} is not read: use triangles or tetrahedra of order 1 or 2 \
         (`Mesh.ElementOrder = 1`, no recombination into quadrangles)"
    )]
    ElementType(u64),
    /// A triangle beside tetrahedra that is no face of them.
    #[error(
        "element {tag} is a triangle that is no face of a tetrahedron: a body has one dimension"
    )]
    MixedDimensions {
        /// The element's tag.
        tag: u64,
    },
    /// A node off the plane z = 0.
    #[error("node {tag} has z = {z}: without tetrahedra the mesh is plane and needs z = 0")]
    NotPlane {
        /// The node's tag.
        tag: u64,
        /// Its third coordinate.
        z: f64,
    },
    /// An element of zero measure.
    #[error("element {tag} has {} {measure:e}: it is degenerate", shape.measure_name)]
    Measure {
        /// The element's tag.
        tag: u64,
        /// Its signed area or volume.
        measure: f64,
        /// What it is.
        shape: &'static Shape,
    },
}

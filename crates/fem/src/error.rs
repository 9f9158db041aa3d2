//! Errors found before a computation starts, for example in files, meshes, groups and sizes of inputs.

use std::path::PathBuf;

use crate::element::Shape;
use crate::mesh::defect::{ElementName, MeshDefect};

/// Error of the setup routines of this crate.
///
/// The element loops return [`Inverted`](crate::solid::Inverted) instead, because an integrator can
/// recover from it.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum FemError {
    /// The mesh file could not be read.
    #[error("cannot read mesh {}: {source}", path.display())]
    Io {
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The mesh file has an unsupported or invalid format.
    #[error("{file}, line {line}: {problem}")]
    Msh {
        /// Name of the file as given.
        file: String,
        /// One-based line number.
        line: usize,
        /// Problem found on that line.
        problem: MshProblem,
    },
    /// Unknown physical group.
    #[error("the mesh has no group \"{name}\"; its groups are: {}", list(known))]
    UnknownGroup {
        name: String,
        /// Names of the available groups.
        known: Vec<String>,
    },
    /// Unknown nodal field.
    #[error("the mesh has no nodal field \"{name}\"; its fields are: {}", list(known))]
    UnknownField {
        name: String,
        /// Names of the available fields.
        known: Vec<String>,
    },
    /// Group with members of the wrong kind, for example points instead of edges.
    #[error("group \"{name}\" contains {found}, but {needed} are required")]
    WrongGroup { name: String, found: &'static str, needed: &'static str },
    /// Elements that do not form a conforming mesh.
    #[error(transparent)]
    Defect(#[from] MeshDefect),
    /// Element of zero measure.
    #[error(
        "element {element} (vertices {vertices:?}) is degenerate: its {} is {measure:e}",
        shape.measure_name
    )]
    DegenerateElement {
        element: usize,
        vertices: Vec<usize>,
        /// Signed area or volume.
        measure: f64,
        shape: &'static Shape,
    },
    /// Mesh without elements.
    #[error("the mesh has no {}", shape.plural)]
    NoElements { shape: &'static Shape },
    /// Mesh of the wrong dimension for an operation.
    #[error("the mesh has {found} dimensions, but {needed} are required")]
    Dimension { found: usize, needed: usize },
    /// Pressure shared by elements of different bulk modulus or damping.
    #[error(
        "elements with different kappa or beta share the pressure at vertex {vertex}: give each \
         region separate pressures (Space::with_regions)"
    )]
    SharedPressure { vertex: usize },
    /// Element in two regions with added stress.
    #[error(
        "element {element} is in two regions with active or viscous stress: define both stresses in one region"
    )]
    DuplicateAddedStress { element: usize },
    /// Element with a small-strain law in a region with active or viscous stress.
    #[error(
        "element {element} has a small-strain law, which excludes active and viscous stress: use \
         a finite-strain law or Rayleigh damping there"
    )]
    AddedToSmallStrain { element: usize },
    /// Law that does not support a choice of the volume function.
    #[error(
        "the law `{law}` is for small strains or includes its own volumetric energy, so it excludes the logarithmic \
         volumetric energy: use the quadratic energy or another law"
    )]
    VolumeFunction { law: &'static str },
    /// Index out of range.
    #[error("{what} {index} is out of range: the index must be below {count}")]
    OutOfRange {
        /// Name of the indexed items in the message.
        what: &'static str,
        index: usize,
        count: usize,
    },
    /// Vertex that belongs to no element.
    #[error("vertex {vertex} belongs to no {}", shape.name)]
    UnusedVertex { vertex: usize, shape: &'static Shape },
    /// Edge or face of a group that belongs to no element.
    #[error("{} of group \"{group}\" belongs to no {}", facet(vertices), shape.name)]
    UnknownFacet { group: String, vertices: Vec<usize>, shape: &'static Shape },
    /// Boundary edge or face with an element on both sides.
    #[error("boundary {} of group \"{group}\" is inside the body", facet(vertices))]
    InteriorFacet { group: String, vertices: Vec<usize> },
    /// The model has no plane of symmetry normal to the axis, or more than one.
    #[error(
        "the rim of the group does not determine a plane of symmetry normal to {}: the adjacent boundary must be in \
         one such plane, with all nodes fixed along that axis",
        ["x", "y", "z"][*axis]
    )]
    NoSymmetryPlane { axis: usize },
    /// Boundary of an enclosed volume that has several disconnected pieces.
    #[error(
        "group \"{group}\" has {found} disconnected pieces, so the enclosed volume is ambiguous: use \
         a separate group for each piece"
    )]
    DisconnectedBoundary { group: String, found: usize },
    /// List with a wrong number of entries.
    #[error("{what}: found {found}, required {needed}")]
    Count { what: &'static str, found: usize, needed: usize },
    /// Unknown material law.
    #[error("unknown law \"{name}\"; available laws: {}", known.join(", "))]
    UnknownLaw {
        name: String,
        /// Names of the available laws.
        known: Vec<&'static str>,
    },
    /// Constant that a law does not have.
    #[error("the law {law} has no constant \"{name}\"; its constants are: {}", known.join(", "))]
    UnknownConstant { law: &'static str, name: String, known: Vec<&'static str> },
    /// Missing constant of a law.
    #[error("the law {law} requires {name}{}", in_unit(unit))]
    MissingConstant {
        law: &'static str,
        name: &'static str,
        /// Unit; empty for a dimensionless constant.
        unit: &'static str,
    },
    /// Invalid direction vector in a nodal field.
    #[error(
        "the field \"{field}\" is {problem} at node {node}: ({}, {}, {})",
        vector[0], vector[1], vector[2]
    )]
    Direction {
        field: String,
        node: u64,
        vector: [f64; 3],
        /// Reason why the vector is invalid.
        problem: &'static str,
    },
    /// Parameter outside its range.
    #[error("{name} = {value} must be {condition}")]
    Parameter { name: &'static str, value: f64, condition: &'static str },
}

impl FemError {
    /// Replaces element indices by the tags of the mesh file.
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

/// Formats an edge or face by its vertices.
fn facet(vertices: &[usize]) -> String {
    let numbers: Vec<String> = vertices.iter().map(usize::to_string).collect();
    let kind = if vertices.len() == 2 { "edge" } else { "face" };
    format!("{kind} ({})", numbers.join(", "))
}

fn in_unit(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" (in {unit})") }
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "(none)".to_owned() } else { names.join(", ") }
}

/// Problem on a line of a mesh file.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum MshProblem {
    /// Unsupported version of the format.
    #[error(
        "MSH version {0} is not supported, only 4.1 and 2.2: in Gmsh export with \
         File > Export > \"Version 4 ASCII\", or `gmsh -3 -format msh41 FILE.geo` (-2 for a plane body)"
    )]
    Version(String),
    /// Binary file in big-endian byte order.
    #[error("the byte order of this binary file is not supported: set `Mesh.Binary = 0` in Gmsh")]
    ByteOrder,
    /// Text that does not start with `$MeshFormat`.
    #[error(
        "this is not a Gmsh mesh: it must start with $MeshFormat; convert VTU, VTK, Abaqus and other files in Python \
         with `myovib.write_mesh(\"NEW.msh\", *myovib.read_mesh(\"FILE\"))`, or UNV files with `gmsh FILE -save \
         -format msh41 -o NEW.msh`; STL and STEP files contain surfaces: mesh their volume with `gmsh -3`"
    )]
    NotMsh,
    /// Unexpected end of the file.
    #[error("unexpected end of file: expected {0}")]
    Truncated(&'static str),
    /// Unexpected word.
    #[error("expected {expected}, found \"{found}\"")]
    Expected {
        /// Description of the allowed input.
        expected: &'static str,
        found: String,
    },
    /// Duplicate tag.
    #[error("{what} {tag} is defined twice")]
    Duplicate {
        /// Name of the defined items, for example "node".
        what: &'static str,
        /// Tag or name.
        tag: String,
    },
    /// Reference to an undefined node.
    #[error("node {0} is not defined")]
    UnknownNode(u64),
    /// Node of a physical group that belongs to no element of the body.
    #[error("node {0} of a physical group belongs to no element of the body")]
    UnusedNode(u64),
    /// Unsupported element type.
    #[error(
        "element type {0} is not supported: use triangles or tetrahedra of order 1 or 2 \
         (`Mesh.ElementOrder = 1`, no recombination into quadrangles)"
    )]
    ElementType(i64),
    /// Triangle in a tetrahedral mesh, but not a face of any tetrahedron.
    #[error(
        "triangle {tag} is not a face of any tetrahedron: 2D and 3D elements cannot be mixed, and a physical surface of a \
         removed volume must be removed too"
    )]
    MixedDimensions { tag: u64 },
    /// Node with z ≠ 0 in a plane mesh.
    #[error(
        "node {tag} has z = {z}: a mesh without tetrahedra must be plane and parallel to two axes; for a body in \
         space, define a volume in Gmsh and mesh it with `gmsh -3`"
    )]
    NotPlane {
        tag: u64,
        /// Third coordinate.
        z: f64,
    },
    /// Geometry with volumes, but without tetrahedra.
    #[error(
        "the volumes in the file are not meshed, only their {meshed}: use `gmsh -3 -format msh41` instead of \
         `-{dimension}`; if the volumes are in no physical group, add them to one, since Gmsh saves only groups"
    )]
    NotMeshed {
        /// Highest dimension of the elements.
        dimension: u64,
        /// Name of the parts of this dimension.
        meshed: &'static str,
    },
    /// File without triangles or tetrahedra.
    #[error(
        "the file has {meshed}, but no triangles or tetrahedra: mesh it with `gmsh -2` or `gmsh -3`, and add the \
         tissue to a `Physical Surface` in the plane or a `Physical Volume` in space, since Gmsh saves only such groups"
    )]
    NoElements {
        /// Name of the parts of the highest dimension.
        meshed: &'static str,
    },
    /// Element of zero measure.
    #[error(
        "element {tag} is degenerate: its {} is {measure:e}; mesh the body again with `gmsh -{}`, or delete the \
         element if two of its nodes are the same and its neighbors fill the body",
        shape.measure_name,
        shape.dimension
    )]
    DegenerateElement {
        tag: u64,
        /// Signed area or volume.
        measure: f64,
        shape: &'static Shape,
    },
}

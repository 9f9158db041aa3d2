//! Reader for the Gmsh formats MSH 4.1 and 2.2, ASCII and binary.
//!
//! The reader supports the sections `PhysicalNames`, `Entities`, `PartitionedEntities`, `Nodes`, `Elements` and
//! `NodeData`, with points, lines, triangles and tetrahedra of first and second order. It skips other sections.
//! The partitions of a mesh are joined, and ghost elements, which are copies, are dropped. Counts in headers are
//! never used to reserve memory, and each counted item consumes a line, so a wrong count leads to an error. The
//! module [`assemble`] builds the mesh.
//!
//! Reference: Gmsh reference manual, "MSH file format", versions 4.1 and 2.

mod assemble;
mod binary;
mod lines;
mod version2;

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use std::str::SplitWhitespace;

use crate::error::{FemError, MshProblem};
use crate::mesh::Mesh;
use lines::{Lines, coordinate, excerpt, number};

impl Mesh {
    /// Reads a Gmsh file.
    ///
    /// # Errors
    /// Returns [`FemError::Io`] if the file cannot be read, or an error of [`Mesh::parse_msh`].
    pub fn read_msh(path: impl AsRef<Path>) -> Result<Self, FemError> {
        let path = path.as_ref();
        let content =
            std::fs::read(path).map_err(|source| FemError::Io { path: path.to_owned(), source })?;
        Self::parse_msh(content, &path.display().to_string())
    }

    /// Parses the content of a Gmsh file. Messages refer to the file as `name`.
    ///
    /// # Errors
    /// Returns [`FemError::Msh`] with the line number, or an error of [`Mesh::new`]. For a binary file, the line
    /// number refers to the same file in ASCII format.
    pub fn parse_msh(content: impl AsRef<[u8]>, name: &str) -> Result<Self, FemError> {
        let error_at = |line, problem| FemError::Msh { file: name.to_owned(), line, problem };
        // Some editors write a byte order mark.
        let content = content.as_ref();
        let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
        let text = match binary::is_binary(content) {
            true => Cow::Owned(binary::to_ascii(content).map_err(|problem| error_at(1, problem))?),
            false => String::from_utf8_lossy(content),
        };
        let mut lines = Lines { text: text.lines(), number: 0 };
        let mut file = parse(&mut lines).map_err(|problem| error_at(lines.number, problem))?;
        let axes = file.flatten();
        let mesh = file.assemble(name)?;
        Ok(mesh.with_earlier_notes(
            axes.map(|axes| super::MeshNote::Plane { axes }).into_iter().collect(),
        ))
    }
}

/// Element type of Gmsh.
struct ElementType {
    number: i64,
    dimension: u64,
    vertices: usize,
    /// Edges on which the midside nodes are. These nodes follow the vertices.
    midpoints: &'static [[usize; 2]],
}

const ELEMENT_TYPES: [ElementType; 7] = [
    ElementType::new(15, 0, 1, &[]),
    ElementType::new(1, 1, 2, &[]),
    ElementType::new(2, 2, 3, &[]),
    ElementType::new(4, 3, 4, &[]),
    ElementType::new(8, 1, 2, &[[0, 1]]),
    ElementType::new(9, 2, 3, &[[0, 1], [1, 2], [2, 0]]),
    // In Gmsh, the last two edges are swapped compared with `Shape::edges`.
    ElementType::new(11, 3, 4, &[[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]]),
];

impl ElementType {
    const fn new(
        number: i64,
        dimension: u64,
        vertices: usize,
        midpoints: &'static [[usize; 2]],
    ) -> Self {
        Self { number, dimension, vertices, midpoints }
    }

    fn find(number: i64) -> Result<&'static Self, MshProblem> {
        let kind = ELEMENT_TYPES.iter().find(|kind| kind.number == number);
        kind.ok_or(MshProblem::ElementType(number))
    }

    fn n_nodes(&self) -> u64 {
        (self.vertices + self.midpoints.len()) as u64
    }
}

/// Node of the file.
struct Node {
    tag: u64,
    line: usize,
    position: [f64; 3],
}

/// Element of the file.
struct Cell {
    tag: u64,
    line: usize,
    dimension: u64,
    /// Tag of the entity to which the element belongs.
    entity: i64,
    /// Vertices, as indices into `MshFile::nodes`.
    vertices: Vec<usize>,
}

/// Values of a nodal field.
struct Data {
    components: usize,
    /// Values, keyed by node tag.
    values: HashMap<u64, Vec<f64>>,
}

/// Parsed content of a file.
#[derive(Default)]
struct MshFile {
    names: HashMap<(u64, i64), String>,
    /// Physical tags, keyed by the dimension and tag of the entity.
    physical: HashMap<(u64, i64), Vec<i64>>,
    /// Tags of the entities that contain copies of elements from other partitions.
    ghosts: HashSet<i64>,
    /// Whether the geometry has volumes.
    has_volumes: bool,
    /// Index of each node, keyed by the tag of the node.
    node_indices: HashMap<u64, usize>,
    nodes: Vec<Node>,
    cells: Vec<Cell>,
    /// Midside node of each edge, keyed by the sorted ends of the edge.
    midpoints: BTreeMap<[usize; 2], usize>,
    data: BTreeMap<String, Data>,
}

fn parse(lines: &mut Lines<'_>) -> Result<MshFile, MshProblem> {
    let version = header(lines)?;
    let mut file = MshFile::default();
    let mut seen = HashSet::new();
    while let Some(line) = lines.next() {
        let Some(section) = line.strip_prefix('$') else {
            return Err(MshProblem::Expected { expected: "a section", found: excerpt(line) });
        };
        if !seen.insert(section) && section != "NodeData" {
            return Err(MshProblem::Duplicate { what: "section", tag: excerpt(section) });
        }
        match section {
            "PhysicalNames" => file.physical_names(lines)?,
            "Entities" => {
                file.entities(lines, false)?;
                lines.close("$EndEntities")?;
            }
            "PartitionedEntities" => file.partitioned_entities(lines)?,
            "Nodes" if version == Version::V2 => file.nodes_2(lines)?,
            "Nodes" => file.nodes(lines)?,
            "Elements" if version == Version::V2 => file.elements_2(lines)?,
            "Elements" => file.elements(lines)?,
            "NodeData" => file.node_data(lines)?,
            other => {
                let end = format!("$End{other}");
                while lines.expect("the end of a section")? != end {}
            }
        }
    }
    for section in ["Nodes", "Elements"] {
        if !seen.contains(section) {
            return Err(MshProblem::Truncated(section));
        }
    }
    // Only elements of the highest dimension can be ghosts.
    let dimension = file.cells.iter().map(|cell| cell.dimension).max();
    let ghosts = &file.ghosts;
    file.cells.retain(|cell| Some(cell.dimension) != dimension || !ghosts.contains(&cell.entity));
    Ok(file)
}

/// Version of the format.
#[derive(PartialEq)]
enum Version {
    V2,
    V4,
}

fn header(lines: &mut Lines<'_>) -> Result<Version, MshProblem> {
    let mut first = lines.next();
    if first == Some("$Comments") {
        while lines.expect("the end of a section")? != "$EndComments" {}
        first = lines.next();
    }
    if first != Some("$MeshFormat") {
        return Err(MshProblem::NotMsh);
    }
    let mut words = lines.words("the format's version")?;
    let version = match words.next().unwrap_or_default() {
        "2.2" | "2" => Version::V2,
        "4.1" => Version::V4,
        other => return Err(MshProblem::Version(excerpt(other))),
    };
    lines.close("$EndMeshFormat")?;
    Ok(version)
}

/// Returns the name of the entity's kind, as used in group names.
pub(super) fn kind_of(dimension: u64) -> &'static str {
    let kinds = ["point", "curve", "surface", "volume"];
    kinds.get(dimension as usize).copied().unwrap_or("entity")
}

impl MshFile {
    /// Reads the names of groups. If groups of different dimensions have the same name, the name is preceded by
    /// the kind of entity, as in `surface skin`.
    fn physical_names(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let count: usize = number(&mut lines.words("a count")?, "a count of names")?;
        let mut names = HashSet::new();
        for _ in 0..count {
            let line = lines.expect("a physical name")?;
            let mut words = line.split_whitespace();
            let dimension = number(&mut words, "a dimension")?;
            let tag = number(&mut words, "a physical tag")?;
            let name = line
                .split_once('"')
                .and_then(|(_, rest)| rest.rsplit_once('"'))
                .map(|(name, _)| name.to_owned())
                .ok_or_else(|| MshProblem::Expected {
                    expected: "a name in double quotes",
                    found: excerpt(line),
                })?;
            if !names.insert((dimension, name.clone())) {
                return Err(MshProblem::Duplicate { what: "physical name", tag: name });
            }
            self.names.insert((dimension, tag), name);
        }
        // A name is ambiguous if groups of different dimensions share it.
        for ((dimension, _), name) in &mut self.names {
            let is_other = |(other, own): &(u64, String)| other != dimension && *own == *name;
            if names.iter().any(is_other) {
                *name = format!("{} {name}", kind_of(*dimension));
            }
        }
        lines.close("$EndPhysicalNames")
    }

    /// Reads the entities of the partitions. Their elements have other entity tags than the elements of the whole
    /// mesh.
    fn partitioned_entities(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let count = "a count of partitions";
        number::<usize>(&mut lines.words(count)?, count)?;
        let count = "a count of ghost entities";
        let n_ghosts: usize = number(&mut lines.words(count)?, count)?;
        for _ in 0..n_ghosts {
            let mut words = lines.words("a ghost entity")?;
            self.ghosts.insert(number(&mut words, "an entity's tag")?);
        }
        self.entities(lines, true)?;
        lines.close("$EndPartitionedEntities")
    }

    /// Reads the lists of points, curves, surfaces and volumes.
    fn entities(&mut self, lines: &mut Lines<'_>, are_partitioned: bool) -> Result<(), MshProblem> {
        let mut words = lines.words("counts of entities")?;
        let mut counts = [0_usize; 4];
        for count in &mut counts {
            *count = number(&mut words, "a count of entities")?;
        }
        self.has_volumes |= counts[3] > 0;
        for (dimension, count) in (0..).zip(counts) {
            // Points have coordinates; other entities have a bounding box.
            let n_coordinates = if dimension == 0 { 3 } else { 6 };
            for _ in 0..count {
                let mut words = lines.words("an entity")?;
                let tag = number(&mut words, "an entity's tag")?;
                if are_partitioned {
                    number::<i64>(&mut words, "the dimension of the parent entity")?;
                    number::<i64>(&mut words, "the tag of the parent entity")?;
                    let n_partitions: usize = number(&mut words, "a count of partitions")?;
                    for _ in 0..n_partitions {
                        number::<i64>(&mut words, "a partition's tag")?;
                    }
                }
                for _ in 0..n_coordinates {
                    number::<f64>(&mut words, "a coordinate")?;
                }
                let n_physical: usize = number(&mut words, "a count of physical tags")?;
                let mut physical = Vec::new();
                for _ in 0..n_physical {
                    // Gmsh writes a negative tag if the group contains the curve in reverse
                    // direction.
                    physical.push(number::<i64>(&mut words, "a physical tag")?.saturating_abs());
                }
                self.physical.insert((dimension, tag), physical);
            }
        }
        Ok(())
    }

    fn nodes(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let blocks: usize = number(&mut lines.words("a count")?, "a count of node blocks")?;
        for _ in 0..blocks {
            let mut words = lines.words("a node block")?;
            for what in ["an entity's dimension", "an entity's tag", "0 or 1 (parametric)"] {
                number::<i64>(&mut words, what)?;
            }
            let count: usize = number(&mut words, "a count of nodes")?;
            let mut tags: Vec<u64> = Vec::new();
            for _ in 0..count {
                tags.push(number(&mut lines.words("a node's tag")?, "a node's tag")?);
            }
            for tag in tags {
                let mut words = lines.words("a node's coordinates")?;
                self.add_node(tag, &mut words, lines.number)?;
            }
        }
        lines.close("$EndNodes")
    }

    /// Adds a node with the coordinates in `words`.
    fn add_node(
        &mut self,
        tag: u64,
        words: &mut SplitWhitespace<'_>,
        line: usize,
    ) -> Result<(), MshProblem> {
        let mut position = [0.0; 3];
        for x in &mut position {
            *x = coordinate(words)?;
        }
        if self.node_indices.insert(tag, self.nodes.len()).is_some() {
            return Err(MshProblem::Duplicate { what: "node", tag: tag.to_string() });
        }
        self.nodes.push(Node { tag, line, position });
        Ok(())
    }

    fn elements(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let blocks: usize = number(&mut lines.words("a count")?, "a count of element blocks")?;
        for _ in 0..blocks {
            let mut words = lines.words("an element block")?;
            let block_dimension: u64 = number(&mut words, "an entity's dimension")?;
            let entity = number(&mut words, "an entity's tag")?;
            let kind = ElementType::find(number(&mut words, "an element type")?)?;
            if kind.dimension != block_dimension {
                return Err(MshProblem::Expected {
                    expected: "an element type of the entity's dimension",
                    found: format!(
                        "elements of dimension {} in an entity of dimension {block_dimension}",
                        kind.dimension
                    ),
                });
            }
            let count: usize = number(&mut words, "a count of elements")?;
            for _ in 0..count {
                let mut words = lines.words("an element")?;
                let tag = number(&mut words, "an element's tag")?;
                let vertices = self.element_nodes(kind, &mut words)?;
                self.cells.push(Cell {
                    tag,
                    line: lines.number,
                    dimension: kind.dimension,
                    entity,
                    vertices,
                });
            }
        }
        lines.close("$EndElements")
    }

    /// Reads the nodes of an element, stores its midside nodes, and returns its vertices.
    fn element_nodes(
        &mut self,
        kind: &ElementType,
        words: &mut SplitWhitespace<'_>,
    ) -> Result<Vec<usize>, MshProblem> {
        let mut node = || {
            let tag = number(words, "a node's tag")?;
            let index = self.node_indices.get(&tag).copied();
            index.ok_or(MshProblem::UnknownNode(tag))
        };
        let vertices = (0..kind.vertices).map(|_| node());
        let vertices = vertices.collect::<Result<Vec<usize>, _>>()?;
        for edge in kind.midpoints {
            let ends = crate::mesh::sorted(edge.map(|i| vertices[i]));
            self.midpoints.insert(ends, node()?);
        }
        Ok(vertices)
    }

    /// Reads nodal values. The string tags (the name first), real tags and integer tags (time step, number of
    /// components, number of nodes, …) precede the values.
    fn node_data(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let mut tags = |what| -> Result<Vec<&str>, MshProblem> {
            let count: usize = number(&mut lines.words("a count of tags")?, "a count of tags")?;
            (0..count).map(|_| lines.expect(what)).collect()
        };
        let names = tags("a name")?;
        tags("a real tag")?;
        let counts = tags("an integer tag")?;
        let name = names.first().map_or("", |name| name.trim_matches('"'));
        let count = |index: usize, what| {
            let word = counts.get(index).copied().unwrap_or("nothing");
            number::<usize>(&mut word.split_whitespace(), what)
        };
        let components = count(1, "a number of components")?;
        let n_values = count(2, "a number of nodes")?;
        let mut values = HashMap::new();
        for _ in 0..n_values {
            let mut words = lines.words("values at a node")?;
            let node = number(&mut words, "a node's tag")?;
            if !self.node_indices.contains_key(&node) {
                return Err(MshProblem::UnknownNode(node));
            }
            let entries = (0..components).map(|_| number(&mut words, "a value"));
            values.insert(node, entries.collect::<Result<Vec<f64>, _>>()?);
        }
        lines.close("$EndNodeData")?;
        let data = Data { components, values };
        if self.data.insert(name.to_owned(), data).is_some() {
            return Err(MshProblem::Duplicate { what: "nodal data", tag: name.to_owned() });
        }
        Ok(())
    }
}

//! Reader of Gmsh's MSH 4.1 ASCII format.
//!
//! Reads what a plane mesh needs (sections `PhysicalNames`, `Entities`, `Nodes`, `Elements`;
//! points, 2-node lines, 3-node triangles) and skips other sections. Counts in headers are never
//! used to reserve memory, and each counted item consumes a line, so a damaged file ends in an
//! error. Nodes of no triangle (centres of arcs, say) are dropped.
//!
//! Reference: Gmsh reference manual, "MSH file format", version 4.1.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use std::str::{FromStr, SplitWhitespace};

use crate::element::TRIANGLE;
use crate::error::{FemError, MshProblem};
use crate::mesh::{Group, Mesh, MeshNote, UnnamedGroup, is_degenerate, measure};

impl Mesh {
    /// Reads a Gmsh MSH 4.1 ASCII file.
    ///
    /// # Errors
    /// [`FemError::Io`], [`FemError::Msh`] with the line number, or those of [`Mesh::new`].
    pub fn read_msh(path: impl AsRef<Path>) -> Result<Self, FemError> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| FemError::Io {
            path: path.to_owned(),
            source,
        })?;
        // Binary files are not UTF-8; their header line still is, and is what gets reported.
        Self::parse_msh(
            &String::from_utf8_lossy(&bytes),
            &path.display().to_string(),
        )
    }

    /// Reads the text of a Gmsh MSH 4.1 ASCII file; `name` stands for the file in messages.
    ///
    /// # Errors
    /// [`FemError::Msh`] with the line number, or those of [`Mesh::new`].
    pub fn parse_msh(text: &str, name: &str) -> Result<Self, FemError> {
        let mut lines = Lines {
            text: text.lines(),
            number: 0,
        };
        let file = parse(&mut lines).map_err(|problem| FemError::Msh {
            file: name.to_owned(),
            line: lines.number,
            problem,
        })?;
        let mesh = Mesh::new(file.points, file.triangles, file.groups)
            .map_err(|error| error.with_tags(&file.triangle_tags))?;
        Ok(mesh.after(file.unnamed))
    }
}

struct Lines<'a> {
    text: std::str::Lines<'a>,
    number: usize,
}

impl<'a> Lines<'a> {
    /// The next line that is not blank, or `None` at the end of the text.
    fn next(&mut self) -> Option<&'a str> {
        for line in self.text.by_ref() {
            self.number += 1;
            if !line.trim().is_empty() {
                return Some(line.trim());
            }
        }
        None
    }

    fn expect(&mut self, what: &'static str) -> Result<&'a str, MshProblem> {
        self.next().ok_or(MshProblem::Truncated(what))
    }

    fn words(&mut self, what: &'static str) -> Result<SplitWhitespace<'a>, MshProblem> {
        Ok(self.expect(what)?.split_whitespace())
    }

    fn close(&mut self, end: &'static str) -> Result<(), MshProblem> {
        match self.expect(end)? {
            line if line == end => Ok(()),
            line => Err(MshProblem::Expected {
                expected: end,
                found: excerpt(line),
            }),
        }
    }
}

/// The next word as a number; `what` names it in messages.
fn number<T: FromStr>(
    words: &mut SplitWhitespace<'_>,
    what: &'static str,
) -> Result<T, MshProblem> {
    let word = words.next().unwrap_or("end of line");
    word.parse().map_err(|_| MshProblem::Expected {
        expected: what,
        found: excerpt(word),
    })
}

fn coordinate(words: &mut SplitWhitespace<'_>) -> Result<f64, MshProblem> {
    let x: f64 = number(words, "a coordinate")?;
    if x.is_finite() {
        Ok(x)
    } else {
        Err(MshProblem::Expected {
            expected: "a finite coordinate",
            found: x.to_string(),
        })
    }
}

fn excerpt(line: &str) -> String {
    line.chars().take(60).collect()
}

#[derive(Default)]
struct File {
    names: HashMap<(u64, i64), String>,
    /// Physical tags of each entity (dimension, tag).
    physical: HashMap<(u64, i64), Vec<i64>>,
    nodes: HashMap<u64, usize>,
    tags: Vec<u64>,
    points: Vec<[f64; 2]>,
    triangles: Vec<[usize; 3]>,
    triangle_tags: Vec<u64>,
    groups: BTreeMap<String, Group>,
    unnamed: Vec<MeshNote>,
}

fn parse(lines: &mut Lines<'_>) -> Result<File, MshProblem> {
    header(lines)?;
    let mut file = File::default();
    let mut members = Vec::new();
    let mut seen = HashSet::new();
    while let Some(line) = lines.next() {
        let Some(section) = line.strip_prefix('$') else {
            return Err(MshProblem::Expected {
                expected: "a section",
                found: excerpt(line),
            });
        };
        if !seen.insert(section) {
            return Err(MshProblem::Duplicate {
                what: "section",
                tag: excerpt(section),
            });
        }
        match section {
            "PhysicalNames" => file.physical_names(lines)?,
            "Entities" => file.entities(lines)?,
            "Nodes" => file.nodes(lines)?,
            "Elements" => members = file.elements(lines)?,
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
    file.drop_loose_nodes(&mut members)?;
    file.collect_groups(&members);
    Ok(file)
}

fn header(lines: &mut Lines<'_>) -> Result<(), MshProblem> {
    if lines.next() != Some("$MeshFormat") {
        return Err(MshProblem::NotMsh);
    }
    let mut words = lines.words("the format's version")?;
    let version = words.next().unwrap_or_default();
    if version != "4.1" {
        return Err(MshProblem::Version(excerpt(version)));
    }
    if number::<u8>(&mut words, "0 (ASCII) or 1 (binary)")? != 0 {
        return Err(MshProblem::Binary);
    }
    lines.close("$EndMeshFormat")
}

/// An element that carries physical groups: dimension, groups, nodes (for a triangle: its index).
struct Member {
    dimension: u64,
    physical: Vec<i64>,
    ids: Vec<usize>,
}

impl File {
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
            if !names.insert(name.clone()) {
                return Err(MshProblem::Duplicate {
                    what: "physical name",
                    tag: name,
                });
            }
            self.names.insert((dimension, tag), name);
        }
        lines.close("$EndPhysicalNames")
    }

    fn entities(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let mut words = lines.words("counts of entities")?;
        let mut counts = [0_usize; 4];
        for count in &mut counts {
            *count = number(&mut words, "a count of entities")?;
        }
        for (dimension, count) in (0..).zip(counts) {
            // A point has its place, the others a bounding box.
            let n_coordinates = if dimension == 0 { 3 } else { 6 };
            for _ in 0..count {
                let mut words = lines.words("an entity")?;
                let tag = number(&mut words, "an entity's tag")?;
                for _ in 0..n_coordinates {
                    number::<f64>(&mut words, "a coordinate")?;
                }
                let n_physical: usize = number(&mut words, "a count of physical tags")?;
                let mut physical = Vec::new();
                for _ in 0..n_physical {
                    // Gmsh writes a negative tag where the group takes the curve reversed.
                    physical.push(number::<i64>(&mut words, "a physical tag")?.saturating_abs());
                }
                self.physical.insert((dimension, tag), physical);
            }
        }
        lines.close("$EndEntities")
    }

    fn nodes(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let blocks: usize = number(&mut lines.words("a count")?, "a count of node blocks")?;
        for _ in 0..blocks {
            let mut words = lines.words("a node block")?;
            for what in [
                "an entity's dimension",
                "an entity's tag",
                "0 or 1 (parametric)",
            ] {
                number::<i64>(&mut words, what)?;
            }
            let count: usize = number(&mut words, "a count of nodes")?;
            let mut tags: Vec<u64> = Vec::new();
            for _ in 0..count {
                tags.push(number(&mut lines.words("a node's tag")?, "a node's tag")?);
            }
            for tag in tags {
                let mut words = lines.words("a node's coordinates")?;
                let point = [coordinate(&mut words)?, coordinate(&mut words)?];
                let z = coordinate(&mut words)?;
                if z != 0.0 {
                    return Err(MshProblem::NotPlane { tag, z });
                }
                if self.nodes.insert(tag, self.points.len()).is_some() {
                    return Err(MshProblem::Duplicate {
                        what: "node",
                        tag: tag.to_string(),
                    });
                }
                self.tags.push(tag);
                self.points.push(point);
            }
        }
        lines.close("$EndNodes")
    }

    fn elements(&mut self, lines: &mut Lines<'_>) -> Result<Vec<Member>, MshProblem> {
        let mut members = Vec::new();
        let blocks: usize = number(&mut lines.words("a count")?, "a count of element blocks")?;
        for _ in 0..blocks {
            let mut words = lines.words("an element block")?;
            let block_dimension: u64 = number(&mut words, "an entity's dimension")?;
            let entity = number(&mut words, "an entity's tag")?;
            let (dimension, n_nodes) = match number(&mut words, "an element type")? {
                15 => (0, 1),
                1 => (1, 2),
                2 => (2, 3),
                other => return Err(MshProblem::ElementType(other)),
            };
            if dimension != block_dimension {
                return Err(MshProblem::Expected {
                    expected: "an element type of the entity's dimension",
                    found: format!("elements of dimension {dimension} on {block_dimension}"),
                });
            }
            let count: usize = number(&mut words, "a count of elements")?;
            let physical = self
                .physical
                .get(&(dimension, entity))
                .cloned()
                .unwrap_or_default();
            for _ in 0..count {
                let mut words = lines.words("an element")?;
                let tag = number(&mut words, "an element's tag")?;
                let mut ids = Vec::with_capacity(n_nodes);
                for _ in 0..n_nodes {
                    let node = number(&mut words, "a node's tag")?;
                    let index = self.nodes.get(&node).ok_or(MshProblem::UnknownNode(node))?;
                    ids.push(*index);
                }
                if let &[a, b, c] = ids.as_slice() {
                    let corners = [a, b, c].map(|v| self.points[v]);
                    if is_degenerate(&corners) {
                        return Err(MshProblem::Measure {
                            tag,
                            measure: measure(&corners),
                            shape: &TRIANGLE,
                        });
                    }
                    ids = vec![self.triangles.len()];
                    self.triangles.push([a, b, c]);
                    self.triangle_tags.push(tag);
                }
                if !physical.is_empty() {
                    members.push(Member {
                        dimension,
                        physical: physical.clone(),
                        ids,
                    });
                }
            }
        }
        lines.close("$EndElements")?;
        Ok(members)
    }

    /// Forgets the nodes that no triangle uses and renumbers the others, in the file's order.
    fn drop_loose_nodes(&mut self, members: &mut [Member]) -> Result<(), MshProblem> {
        let mut used = vec![false; self.points.len()];
        for &v in self.triangles.iter().flatten() {
            used[v] = true;
        }
        let mut renumbered = vec![0; used.len()];
        for (new, old) in (0..used.len()).filter(|&v| used[v]).enumerate() {
            renumbered[old] = new;
        }
        for id in members
            .iter_mut()
            .filter(|m| m.dimension < 2)
            .flat_map(|m| &mut m.ids)
        {
            if !used[*id] {
                return Err(MshProblem::LooseNode(self.tags[*id]));
            }
            *id = renumbered[*id];
        }
        for v in self.triangles.iter_mut().flatten() {
            *v = renumbered[*v];
        }
        self.points = (0..used.len())
            .filter(|&v| used[v])
            .map(|v| self.points[v])
            .collect();
        Ok(())
    }

    fn collect_groups(&mut self, members: &[Member]) {
        let mut unnamed = BTreeMap::new();
        for member in members {
            for &tag in &member.physical {
                let Some(name) = self.names.get(&(member.dimension, tag)) else {
                    *unnamed.entry((member.dimension, tag)).or_insert(0) += 1;
                    continue;
                };
                let group = self
                    .groups
                    .entry(name.clone())
                    .or_insert(match member.dimension {
                        0 => Group::Points(Vec::new()),
                        1 => Group::Edges(Vec::new()),
                        _ => Group::Elements(Vec::new()),
                    });
                match (group, member.ids.as_slice()) {
                    (Group::Points(points), &[v]) => points.push(v),
                    (Group::Edges(edges), &[a, b]) => edges.push([a, b]),
                    (Group::Elements(triangles), &[e]) => triangles.push(e),
                    _ => {}
                }
            }
        }
        let note = |((dimension, tag), elements)| {
            MeshNote::Unnamed(UnnamedGroup {
                dimension,
                tag,
                elements,
            })
        };
        self.unnamed = unnamed.into_iter().map(note).collect();
    }
}

//! Sections of version 2.2 that differ from version 4.1: nodes, and elements (which include the tags of their
//! physical groups).

use std::collections::HashMap;

use super::{Cell, ElementType, Lines, MshFile, MshProblem, number};

impl MshFile {
    /// Reads nodes, each with a tag and coordinates.
    pub(super) fn nodes_2(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let count: usize = number(&mut lines.words("a count")?, "a count of nodes")?;
        for _ in 0..count {
            let mut words = lines.words("a node")?;
            let tag = number(&mut words, "a node's tag")?;
            self.add_node(tag, &mut words, lines.number)?;
        }
        lines.close("$EndNodes")
    }

    /// Reads elements, each with a tag, a type, the number of tags, the tags (physical group, entity, partitions)
    /// and the nodes.
    ///
    /// Gmsh lists an element once for each of its physical groups. Here, each element becomes a separate entity
    /// that belongs to all these groups.
    pub(super) fn elements_2(&mut self, lines: &mut Lines<'_>) -> Result<(), MshProblem> {
        let count: usize = number(&mut lines.words("a count")?, "a count of elements")?;
        let mut entities: HashMap<Vec<usize>, i64> = HashMap::new();
        for _ in 0..count {
            let mut words = lines.words("an element")?;
            let tag = number(&mut words, "an element's tag")?;
            let kind = ElementType::find(number(&mut words, "an element type")?)?;
            let n_tags: usize = number(&mut words, "a count of tags")?;
            let mut physical = 0_i64;
            for k in 0..n_tags {
                let tag: i64 = number(&mut words, "a tag")?;
                if k == 0 {
                    physical = tag.saturating_abs();
                }
            }
            let vertices = self.element_nodes(kind, &mut words)?;
            let next = entities.len() as i64;
            let entity = *entities.entry(vertices.clone()).or_insert(next);
            let groups = self.physical.entry((kind.dimension, entity)).or_default();
            if physical != 0 && !groups.contains(&physical) {
                groups.push(physical);
            }
            if entity == next {
                self.cells.push(Cell {
                    tag,
                    line: lines.number,
                    dimension: kind.dimension,
                    entity,
                    vertices,
                });
            }
        }
        // Version 2.2 does not list the volumes of the geometry. The names of groups show whether volumes exist.
        self.has_volumes = self.names.keys().any(|(dimension, _)| *dimension == 3);
        lines.close("$EndElements")
    }
}

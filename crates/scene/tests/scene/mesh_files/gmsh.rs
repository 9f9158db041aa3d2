//! Files of a block in the formats and variants of Gmsh.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::lattice::tetrahedra_of;

/// Cells of the block along x.
const CELLS: usize = 4;

/// Parts of a Gmsh file.
#[derive(Clone)]
pub(super) struct File {
    pub(super) points: Vec<[f64; 3]>,
    /// Dimension, tag and name of physical groups.
    pub(super) names: Vec<(usize, usize, &'static str)>,
    /// Elements of each entity.
    pub(super) entities: Vec<Entity>,
    /// Sections before the nodes.
    pub(super) sections: String,
    /// Numbers after the coordinates of each node (parametric coordinates).
    pub(super) parametric: bool,
    /// Difference between consecutive node tags, and offset of the first tag from 1.
    pub(super) tags: [usize; 2],
}

#[derive(Clone)]
pub(super) struct Entity {
    pub(super) dimension: usize,
    pub(super) tag: usize,
    /// Physical groups.
    pub(super) groups: Vec<usize>,
    /// Element type.
    pub(super) kind: usize,
    /// Zero-based node indices of the elements.
    pub(super) elements: Vec<Vec<usize>>,
}

impl Entity {
    pub(super) fn new(
        dimension: usize,
        tag: usize,
        groups: &[usize],
        elements: Vec<Vec<usize>>,
    ) -> Self {
        Self { dimension, tag, groups: groups.to_vec(), kind: [15, 1, 2, 4][dimension], elements }
    }
}

/// Returns the block of 0.1 by 0.02 by 0.02 m with the groups `fix` and `tip` at its ends and `body`.
pub(super) fn block() -> File {
    let number = |[i, j, k]: [usize; 3]| i + (CELLS + 1) * (j + 2 * k);
    let step = 0.1 / CELLS as f64;
    let mut points = vec![[0.0; 3]; 4 * (CELLS + 1)];
    for (i, j, k) in (0..4 * (CELLS + 1)).map(|n| (n / 4, n / 2 % 2, n % 2)) {
        points[number([i, j, k])] = [step * i as f64, 0.02 * j as f64, 0.02 * k as f64];
    }
    let mut tetrahedra = Vec::new();
    let mut ends = [Vec::new(), Vec::new()];
    for i in 0..CELLS {
        for corners in tetrahedra_of([i, 0, 0], 1) {
            for (end, x) in ends.iter_mut().zip([0, CELLS]) {
                let face = corners.iter().filter(|corner| corner[0] == x);
                let face: Vec<usize> = face.map(|&corner| number(corner)).collect();
                if face.len() == 3 {
                    end.push(face);
                }
            }
            tetrahedra.push(corners.into_iter().map(number).collect());
        }
    }
    let [fix, tip] = ends;
    File {
        points,
        names: vec![(2, 1, "fix"), (2, 2, "tip"), (3, 3, "body")],
        entities: vec![
            Entity::new(2, 1, &[1], fix),
            Entity::new(2, 2, &[2], tip),
            Entity::new(3, 1, &[3], tetrahedra),
        ],
        sections: String::new(),
        parametric: false,
        tags: [1, 0],
    }
}

impl File {
    pub(super) fn changed(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut file = self.clone();
        change(&mut file);
        file
    }

    pub(super) fn tag(&self, node: usize) -> usize {
        self.tags[0] * (node + 1) + self.tags[1]
    }

    pub(super) fn head(&self, version: &str) -> String {
        let mut text = format!("$MeshFormat\n{version} 0 8\n$EndMeshFormat\n");
        if !self.names.is_empty() {
            writeln!(text, "$PhysicalNames\n{}", self.names.len()).unwrap();
            for (dimension, tag, name) in &self.names {
                writeln!(text, "{dimension} {tag} \"{name}\"").unwrap();
            }
            text += "$EndPhysicalNames\n";
        }
        text
    }

    pub(super) fn coordinates(&self, node: usize) -> String {
        let [x, y, z] = self.points[node];
        let parameter = if self.parametric { " 0.5" } else { "" };
        format!("{x:?} {y:?} {z:?}{parameter}\n")
    }

    /// Formats the file in version 4.1, or under another `version`.
    pub(super) fn version_4(&self, version: &str) -> String {
        let mut text = self.head(version) + "$Entities\n";
        let of = |dimension| self.entities.iter().filter(move |e| e.dimension == dimension);
        let counts: Vec<String> = (0..4).map(|d| of(d).count().to_string()).collect();
        writeln!(text, "{}", counts.join(" ")).unwrap();
        for entity in (0..4).flat_map(of) {
            let place = ["0 0 0", "0 0 0 1 1 1"][entity.dimension.min(1)];
            let groups: Vec<String> = entity.groups.iter().map(usize::to_string).collect();
            let end = if entity.dimension == 0 { "" } else { " 0" };
            let (tag, n) = (entity.tag, groups.len());
            writeln!(text, "{tag} {place} {n} {}{end}", groups.join(" ")).unwrap();
        }
        text += "$EndEntities\n";
        text += &self.sections;
        let n = self.points.len();
        let parametric = u8::from(self.parametric);
        writeln!(text, "$Nodes\n1 {n} {} {}\n3 1 {parametric} {n}", self.tag(0), self.tag(n - 1))
            .unwrap();
        for node in 0..n {
            writeln!(text, "{}", self.tag(node)).unwrap();
        }
        (0..n).for_each(|node| text += &self.coordinates(node));
        let n: usize = self.entities.iter().map(|e| e.elements.len()).sum();
        writeln!(text, "$EndNodes\n$Elements\n{} {n} 1 {n}", self.entities.len()).unwrap();
        let mut number = 0;
        for Entity { dimension, tag, kind, elements, .. } in &self.entities {
            writeln!(text, "{dimension} {tag} {kind} {}", elements.len()).unwrap();
            for nodes in elements {
                number += 1;
                writeln!(text, "{number} {}", self.words(nodes)).unwrap();
            }
        }
        text + "$EndElements\n"
    }

    pub(super) fn version_2(&self) -> String {
        let mut text = self.head("2.2");
        writeln!(text, "$Nodes\n{}", self.points.len()).unwrap();
        for node in 0..self.points.len() {
            write!(text, "{} {}", self.tag(node), self.coordinates(node)).unwrap();
        }
        let n: usize = self.entities.iter().map(|e| e.elements.len() * e.groups.len()).sum();
        writeln!(text, "$EndNodes\n$Elements\n{n}").unwrap();
        let mut number = 0;
        for entity in &self.entities {
            for (nodes, group) in
                entity.elements.iter().flat_map(|e| entity.groups.iter().map(move |g| (e, g)))
            {
                number += 1;
                let (kind, tag) = (entity.kind, entity.tag);
                writeln!(text, "{number} {kind} 2 {group} {tag} {}", self.words(nodes)).unwrap();
            }
        }
        text + "$EndElements\n"
    }

    pub(super) fn words(&self, nodes: &[usize]) -> String {
        let tags: Vec<String> = nodes.iter().map(|&node| self.tag(node).to_string()).collect();
        tags.join(" ")
    }

    /// Adds midside nodes.
    pub(super) fn second_order(&mut self) {
        let mut middles = BTreeMap::new();
        for entity in &mut self.entities {
            let edges: &[[usize; 2]] = match entity.dimension {
                2 => &[[0, 1], [1, 2], [2, 0]],
                _ => &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
            };
            entity.kind = if entity.dimension == 2 { 9 } else { 11 };
            for nodes in &mut entity.elements {
                for [a, b] in edges {
                    let mut ends = [nodes[*a], nodes[*b]];
                    ends.sort_unstable();
                    let points = &mut self.points;
                    let middle = *middles.entry(ends).or_insert_with(|| {
                        let [a, b] = ends.map(|end| points[end]);
                        points.push([0, 1, 2].map(|i| 0.5 * (a[i] + b[i])));
                        points.len() - 1
                    });
                    nodes.push(middle);
                }
            }
        }
    }

    /// Moves the second half of the block to a separate volume.
    pub(super) fn two_volumes(&mut self) {
        let half = self.entities[2].elements.len() / 2;
        let second = self.entities[2].elements.split_off(half);
        self.entities.push(Entity::new(3, 2, &[3], second));
    }
}

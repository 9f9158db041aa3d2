//! Mesh files whose nodes form a lattice.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// A second-order mesh in Gmsh's format 4.1. Its nodes are identified by lattice coordinates, which `place` maps to
/// their positions.
pub(crate) struct Lattice<const D: usize> {
    dimension: usize,
    numbers: BTreeMap<[usize; D], usize>,
    points: Vec<[f64; 3]>,
    place: Box<dyn Fn([usize; D]) -> [f64; 3]>,
}

impl<const D: usize> Lattice<D> {
    pub(crate) fn new(dimension: usize, place: impl Fn([usize; D]) -> [f64; 3] + 'static) -> Self {
        Self { dimension, numbers: BTreeMap::new(), points: Vec::new(), place: Box::new(place) }
    }

    fn node(&mut self, at: [usize; D]) -> usize {
        *self.numbers.entry(at).or_insert_with(|| {
            self.points.push((self.place)(at));
            self.points.len()
        })
    }

    /// Returns the nodes of a simplex: its corners, then its edges in Gmsh's order.
    pub(crate) fn simplex(&mut self, corners: &[[usize; D]]) -> Vec<usize> {
        let edges: &[[usize; 2]] = match corners.len() {
            2 => &[[0, 1]],
            3 => &[[0, 1], [1, 2], [2, 0]],
            _ => &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
        };
        let middles = edges
            .iter()
            .map(|[a, b]| std::array::from_fn(|i| (corners[*a][i] + corners[*b][i]) / 2));
        let all: Vec<[usize; D]> = corners.iter().copied().chain(middles).collect();
        all.into_iter().map(|at| self.node(at)).collect()
    }

    /// Formats the mesh with groups of the given names; the last name belongs to the body.
    pub(crate) fn msh(&self, groups: &[(&str, Vec<Vec<usize>>)]) -> String {
        let last = groups.len();
        let own = |k: usize| self.dimension - usize::from(k < last);
        let mut text = format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{last}\n");
        for (k, (name, _)) in (1..).zip(groups) {
            writeln!(text, "{} {k} \"{name}\"", own(k)).unwrap();
        }
        text += "$EndPhysicalNames\n$Entities\n";
        text += if self.dimension == 2 { "0 " } else { "0 0 " };
        writeln!(text, "{} 1{}", last - 1, if self.dimension == 2 { " 0" } else { "" }).unwrap();
        for k in 1..=last {
            writeln!(text, "{k} -1 -1 -1 1 1 1 1 {k} 0").unwrap();
        }
        let n = self.points.len();
        writeln!(text, "$EndEntities\n$Nodes\n1 {n} 1 {n}\n{} {last} 0 {n}", self.dimension)
            .unwrap();
        (1..=n).for_each(|number| writeln!(text, "{number}").unwrap());
        for [x, y, z] in &self.points {
            writeln!(text, "{x:e} {y:e} {z:e}").unwrap();
        }
        let total: usize = groups.iter().map(|(_, elements)| elements.len()).sum();
        writeln!(text, "$EndNodes\n$Elements\n{last} {total} 1 {total}").unwrap();
        let mut number = 0;
        for (k, (_, elements)) in (1..).zip(groups) {
            let kind = match elements[0].len() {
                3 => 8,
                6 => 9,
                _ => 11,
            };
            writeln!(text, "{} {k} {kind} {}", own(k), elements.len()).unwrap();
            for nodes in elements {
                number += 1;
                let nodes: Vec<String> = nodes.iter().map(usize::to_string).collect();
                writeln!(text, "{number} {}", nodes.join(" ")).unwrap();
            }
        }
        text + "$EndElements\n"
    }
}

/// Returns the corners of the six tetrahedra around the diagonal of the cell from `corner` to `corner` plus `size` along each axis,
/// with positive volumes.
pub(crate) fn tetrahedra_of(corner: [usize; 3], size: usize) -> [Vec<[usize; 3]>; 6] {
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    orders.map(|order| {
        let mut corners = vec![corner];
        for axis in order {
            let mut next = corners[corners.len() - 1];
            next[axis] += size;
            corners.push(next);
        }
        if (order[1] + 3 - order[0]) % 3 == 2 {
            corners.swap(0, 1);
        }
        corners
    })
}

//! Uniform (red) refinement, which splits each triangle into four elements and each tetrahedron into eight
//! elements.

use std::collections::{BTreeMap, HashMap};

use crate::element::{Degree, Shape, TRIANGLE};
use crate::error::FemError;
use crate::mesh::{Group, Mesh, NodalField, sorted};

/// Children of a triangle with the vertices 0 to 2 and the midpoints 3 to 5.
const TRIANGLES: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

/// Children of a tetrahedron with the vertices 0 to 3 and the midpoints 4 to 9. The inner octahedron is cut along
/// the line from midpoint 6 (of edge 02) to midpoint 8 (of edge 13).
const TETRAHEDRA: [[usize; 4]; 8] = [
    [0, 4, 6, 7],
    [4, 1, 5, 8],
    [6, 5, 2, 9],
    [7, 8, 9, 3],
    [4, 6, 7, 8],
    [4, 5, 6, 8],
    [6, 7, 8, 9],
    [5, 6, 8, 9],
];

impl Mesh {
    /// Returns the mesh with every element split at the midpoints of its edges: triangles into four elements and
    /// tetrahedra into eight elements.
    ///
    /// Existing vertices keep their indices. Groups keep their names, and their members are split. Nodal fields
    /// are interpolated. The children of a curved element follow the shape of the element.
    ///
    /// # Errors
    /// Returns [`FemError::Defect`] if a child of a curved element is inverted.
    pub fn refined(&self) -> Result<Mesh, FemError> {
        match self.dimension() {
            2 => self.split::<2, 3, 4>(&TRIANGLES),
            _ => self.split::<3, 4, 8>(&TETRAHEDRA),
        }
    }

    fn split<const D: usize, const V: usize, const K: usize>(
        &self,
        parts: &[[usize; V]; K],
    ) -> Result<Mesh, FemError> {
        let mut points = self.points::<D>().to_vec();
        let mut midpoints: HashMap<[usize; 2], usize> = HashMap::new();
        let mut midside = BTreeMap::new();
        let mut elements = Vec::with_capacity(K * self.n_elements());
        for element in self.elements() {
            let mut nodes = element.to_vec();
            for edge in self.edges_of(element) {
                nodes.push(*midpoints.entry(edge).or_insert_with(|| {
                    points.push(self.midpoint(edge));
                    points.len() - 1
                }));
            }
            if self.is_curved(element) {
                self.place_midside_nodes(parts, &nodes, &points, &mut midside);
            }
            elements.extend(parts.iter().map(|part| part.map(|i| nodes[i])));
        }
        let halves = |&[p, q]: &[usize; 2]| {
            let middle = midpoints[&sorted([p, q])];
            [[p, middle], [middle, q]]
        };
        let quarters = |face: &[usize; 3]| {
            let middles = TRIANGLE.edges.iter().map(|e| midpoints[&sorted(e.map(|i| face[i]))]);
            let nodes: Vec<usize> = face.iter().copied().chain(middles).collect();
            TRIANGLES.map(|part| part.map(|i| nodes[i]))
        };
        let groups: BTreeMap<String, Group> = self
            .groups()
            .iter()
            .map(|(name, group)| {
                let group = match group {
                    Group::Points(vertices) => Group::Points(vertices.clone()),
                    Group::Edges(edges) => Group::Edges(edges.iter().flat_map(halves).collect()),
                    Group::Faces(faces) => Group::Faces(faces.iter().flat_map(quarters).collect()),
                    Group::Elements(members) => {
                        let parts = members.iter().flat_map(|&e| K * e..K * (e + 1));
                        Group::Elements(parts.collect())
                    }
                };
                (name.clone(), group)
            })
            .collect();
        let fields = self.fields().iter().map(|(name, field)| {
            let mut values = field.values.clone();
            let mut ends: Vec<_> = midpoints.iter().collect();
            ends.sort_unstable_by_key(|(_, middle)| **middle);
            for ([a, b], _) in ends {
                let both = field.at(*a).iter().zip(field.at(*b));
                values.extend(both.map(|(a, b)| 0.5 * (a + b)));
            }
            let components = field.components;
            (name.clone(), NodalField { components, values })
        });
        let mesh = Mesh::new(points, elements, groups)?.with_midside_nodes(midside)?;
        let mesh = mesh.with_fields(fields.collect())?;
        Ok(mesh.with_earlier_notes(self.notes().to_vec()))
    }

    /// Returns whether an edge of an element is curved.
    pub(super) fn is_curved(&self, element: &[usize]) -> bool {
        self.edges_of(element).any(|edge| self.curved_midpoint(edge).is_some())
    }

    /// Inserts the midside nodes of the child elements `parts` of a curved element with the given
    /// `nodes`.
    fn place_midside_nodes<const D: usize, const V: usize>(
        &self,
        parts: &[[usize; V]],
        nodes: &[usize],
        points: &[[f64; D]],
        midside: &mut BTreeMap<[usize; 2], [f64; D]>,
    ) {
        let shape = Shape::of_dimension(D);
        let node_coordinates = shape.nodes(Degree::Two);
        for part in parts {
            for [i, j] in shape.edges.iter().map(|edge| edge.map(|i| part[i])) {
                let both = node_coordinates[i].iter().zip(node_coordinates[j].iter());
                let middle: Vec<f64> = both.map(|(a, b)| 0.5 * (a + b)).collect();
                let values = shape.values(Degree::Two, &middle);
                let position = std::array::from_fn(|m| {
                    let terms = values.iter().zip(nodes);
                    terms.map(|(value, &node)| value * points[node][m]).sum()
                });
                midside.insert(sorted([nodes[i], nodes[j]]), position);
            }
        }
    }
}

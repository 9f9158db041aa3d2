//! Uniform (red) refinement: each triangle into four of its shape.

use std::collections::{BTreeMap, HashMap};

use crate::mesh::{Group, Mesh, sorted, triangle_edges};

impl Mesh {
    /// The mesh with every triangle cut into four at the midpoints of its edges.
    ///
    /// Old vertices keep their numbers; groups keep their names, their edges halved and their
    /// triangles quartered. Curved boundaries stay the polygons they were.
    pub fn refined(&self) -> Mesh {
        let mut points = self.points().to_vec();
        let mut midpoints: HashMap<[usize; 2], usize> = HashMap::new();
        let mut triangles = Vec::with_capacity(4 * self.triangles().len());
        for corners in self.triangles() {
            let [ab, bc, ca] = triangle_edges(corners).map(|edge @ [p, q]| {
                *midpoints.entry(edge).or_insert_with(|| {
                    let ([px, py], [qx, qy]) = (points[p], points[q]);
                    points.push([0.5 * (px + qx), 0.5 * (py + qy)]);
                    points.len() - 1
                })
            });
            let [a, b, c] = *corners;
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        let groups: BTreeMap<String, Group> = self
            .groups()
            .iter()
            .map(|(name, group)| {
                let group = match group {
                    Group::Points(vertices) => Group::Points(vertices.clone()),
                    Group::Edges(edges) => Group::Edges(
                        edges
                            .iter()
                            .flat_map(|&[p, q]| {
                                let middle = midpoints[&sorted([p, q])];
                                [[p, middle], [middle, q]]
                            })
                            .collect(),
                    ),
                    Group::Triangles(members) => {
                        Group::Triangles(members.iter().flat_map(|&e| 4 * e..4 * e + 4).collect())
                    }
                };
                (name.clone(), group)
            })
            .collect();
        Mesh::new(points, triangles, groups)
            .expect("quarters of valid triangles are valid")
            .after(self.notes().to_vec())
    }
}

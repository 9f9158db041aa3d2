//! What a mesh carries beside its elements: nodal fields, and nodes on curved edges.

use std::collections::BTreeMap;

use super::{Mesh, distance, sorted};
use crate::error::FemError;

/// A midpoint this far from the middle of its edge, as a fraction of the edge, makes it curved:
/// beyond what files of eight digits make of a straight one.
const STRAIGHT: f64 = 1e-7;

/// Values at the vertices of a mesh, as `$NodeData` gives them.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalField {
    /// Number of values at each vertex.
    pub components: usize,
    /// The values, vertex by vertex; not a number where the file has none.
    pub values: Vec<f64>,
}

impl NodalField {
    /// The values at a vertex.
    pub fn at(&self, vertex: usize) -> &[f64] {
        &self.values[self.components * vertex..][..self.components]
    }
}

impl Mesh {
    /// The nodal fields, by name.
    pub fn fields(&self) -> &BTreeMap<String, NodalField> {
        &self.fields
    }

    /// The nodal field of that name.
    ///
    /// # Errors
    /// [`FemError::UnknownField`], which lists the fields there are.
    pub fn field(&self, name: &str) -> Result<&NodalField, FemError> {
        self.fields.get(name).ok_or_else(|| FemError::UnknownField {
            name: name.to_owned(),
            known: self.fields.keys().cloned().collect(),
        })
    }

    /// The same mesh with other nodal fields.
    ///
    /// # Errors
    /// [`FemError::Count`] for a field that has not the same number of values at each vertex.
    pub fn with_fields(mut self, fields: BTreeMap<String, NodalField>) -> Result<Self, FemError> {
        for field in fields.values() {
            let (found, needed) = (field.values.len(), field.components * self.n_points());
            if found != needed {
                let what = "values of a nodal field";
                return Err(FemError::Count {
                    what,
                    found,
                    needed,
                });
            }
        }
        self.fields = fields;
        Ok(self)
    }

    /// The same mesh with the quadratic nodes on these edges (by their ends) where they are said to
    /// lie. Those in the middle of their edge leave it straight.
    ///
    /// # Errors
    /// [`FemError::LooseFacet`] for edges that are none of an element, [`FemError::Defect`] for
    /// elements that the nodes turn inside out.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub fn bent<const D: usize>(
        mut self,
        midpoints: BTreeMap<[usize; 2], [f64; D]>,
    ) -> Result<Self, FemError> {
        let edges: std::collections::BTreeSet<_> = self
            .elements()
            .flat_map(|element| self.edges_of(element))
            .collect();
        for (edge, place) in midpoints {
            let ends @ [a, b] = sorted(edge);
            if !edges.contains(&ends) {
                return Err(FemError::LooseFacet {
                    group: "nodes on edges".to_owned(),
                    vertices: edge.to_vec(),
                    shape: self.shape,
                });
            }
            let (a, b) = (self.points::<D>()[a], self.points::<D>()[b]);
            let middle = std::array::from_fn(|m| 0.5 * (a[m] + b[m]));
            if distance(place, middle) > STRAIGHT * distance(a, b) {
                let mut spatial = [0.0; 3];
                spatial[..D].copy_from_slice(&place);
                self.bent.insert(ends, spatial);
            }
        }
        if !self.bent.is_empty() {
            self.check_curved::<D>()?;
        }
        Ok(self)
    }

    /// Where the quadratic node of an edge lies if not in its middle; as many coordinates count as
    /// there are dimensions.
    pub(crate) fn bent_midpoint(&self, edge: [usize; 2]) -> Option<[f64; 3]> {
        self.bent.get(&sorted(edge)).copied()
    }
}

//! Mesh attributes: nodal fields and the midside nodes of curved edges.

use std::collections::BTreeMap;

use super::{Mesh, distance, sorted};
use crate::error::FemError;

/// Maximum distance of the midside node of a straight edge from the midpoint of the edge, as a fraction of its length.
/// If it is exceeded, the edge is curved. In files with eight digits, straight edges stay within this limit.
const STRAIGHT: f64 = 1e-7;

/// Values of a field at the vertices of a mesh, read from `$NodeData`.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalField {
    /// Number of values per vertex.
    pub components: usize,
    /// Values, vertex by vertex. A value is NaN if it is missing in the file.
    pub values: Vec<f64>,
}

impl NodalField {
    /// Returns the values at a vertex.
    pub fn at(&self, vertex: usize) -> &[f64] {
        &self.values[self.components * vertex..][..self.components]
    }
}

impl Mesh {
    /// Returns the nodal fields, keyed by name.
    pub fn fields(&self) -> &BTreeMap<String, NodalField> {
        &self.fields
    }

    /// Returns the nodal field with the given name.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownField`] if the field does not exist; the error lists the available fields.
    pub fn field(&self, name: &str) -> Result<&NodalField, FemError> {
        self.fields.get(name).ok_or_else(|| FemError::UnknownField {
            name: name.to_owned(),
            known: self.fields.keys().cloned().collect(),
        })
    }

    /// Returns the mesh with other nodal fields.
    ///
    /// # Errors
    /// Returns [`FemError::Count`] if the length of a field is not its number of components times the number of
    /// vertices.
    pub fn with_fields(mut self, fields: BTreeMap<String, NodalField>) -> Result<Self, FemError> {
        for field in fields.values() {
            let (found, needed) = (field.values.len(), field.components * self.n_points());
            if found != needed {
                let what = "values of a nodal field";
                return Err(FemError::Count { what, found, needed });
            }
        }
        self.fields = fields;
        Ok(self)
    }

    /// Returns the mesh with midside nodes at the given positions. Each position is keyed by the ends of the edge.
    /// A node at the midpoint of its edge keeps the edge straight.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownFacet`] if an edge does not belong to an element, or [`FemError::Defect`] if the
    /// nodes invert an element.
    pub fn with_midside_nodes<const D: usize>(
        mut self,
        midpoints: BTreeMap<[usize; 2], [f64; D]>,
    ) -> Result<Self, FemError> {
        let edges: std::collections::BTreeSet<_> =
            self.elements().flat_map(|element| self.edges_of(element)).collect();
        for (edge, position) in midpoints {
            let ends @ [a, b] = sorted(edge);
            if !edges.contains(&ends) {
                return Err(FemError::UnknownFacet {
                    group: "midside nodes".to_owned(),
                    vertices: edge.to_vec(),
                    shape: self.shape,
                });
            }
            let (a, b) = (self.points::<D>()[a], self.points::<D>()[b]);
            let midpoint = std::array::from_fn(|m| 0.5 * (a[m] + b[m]));
            if distance(position, midpoint) > STRAIGHT * distance(a, b) {
                let mut spatial = [0.0; 3];
                spatial[..D].copy_from_slice(&position);
                self.midside.insert(ends, spatial);
            }
        }
        if !self.midside.is_empty() {
            let note = self.check_curved::<D>()?;
            self.notes.extend(note);
        }
        Ok(self)
    }

    /// Returns the position of the midside node of a curved edge, or `None` for a straight edge. In 2D, the third
    /// coordinate is 0.
    pub(crate) fn curved_midpoint(&self, edge: [usize; 2]) -> Option<[f64; 3]> {
        self.midside.get(&sorted(edge)).copied()
    }
}

//! Values at a point of the body, as linear functionals of the nodal arrays.

use myovib_fem::{Barycentric, Located, Space};

use super::locate;
use crate::error::ModelError;

/// A point located in its element.
#[derive(Debug, Clone)]
pub struct Probe {
    point: Vec<f64>,
    nodes: Vec<(usize, f64)>,
    vertices: Vec<(usize, f64)>,
}

/// u and p at a probe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeValue {
    /// Displacement, m; in the plane with a third component of zero.
    pub displacement: [f64; 3],
    /// Pressure, Pa; NaN for a formulation without pressure.
    pub pressure: f64,
}

impl Probe {
    /// Locates a point.
    ///
    /// # Errors
    /// [`ModelError::Coordinates`], [`ModelError::OutsideMesh`].
    pub fn at(space: &Space, point: impl AsRef<[f64]>) -> Result<Self, ModelError> {
        let point = point.as_ref();
        let located = locate(space, point)?;
        Ok(Self {
            point: point.to_vec(),
            nodes: space.displacement_functional(&located),
            vertices: space.pressure_functional(&located),
        })
    }

    /// The middle of an element: the mean of its vertices.
    ///
    /// # Panics
    /// If there is no such element.
    pub fn in_element(space: &Space, element: usize) -> Self {
        let mesh = space.mesh();
        let (vertices, dimension) = (mesh.element(element), mesh.dimension());
        let mean = |axis: usize| {
            let along = vertices.iter();
            let along = along.map(|v| mesh.coordinates()[dimension * v + axis]);
            along.sum::<f64>() / vertices.len() as f64
        };
        let located = Located {
            element,
            barycentric: Barycentric::new(&vec![1.0 / vertices.len() as f64; vertices.len()]),
        };
        Self {
            point: (0..dimension).map(mean).collect(),
            nodes: space.displacement_functional(&located),
            vertices: space.pressure_functional(&located),
        }
    }

    /// The point, m.
    pub fn point(&self) -> &[f64] {
        &self.point
    }

    /// The nodes whose values enter, with their weights.
    pub fn node_weights(&self) -> &[(usize, f64)] {
        &self.nodes
    }

    /// A displacement-like nodal array at the point; in the plane with a third component of zero.
    pub fn vector(&self, nodal: &[f64]) -> [f64; 3] {
        let dimension = self.point.len();
        let mut vector = [0.0; 3];
        for (axis, component) in vector[..dimension].iter_mut().enumerate() {
            let values = self
                .nodes
                .iter()
                .map(|(n, w)| w * nodal[dimension * n + axis]);
            *component = values.sum();
        }
        vector
    }

    /// A pressure-like array at the point.
    pub fn scalar(&self, vertex: &[f64]) -> f64 {
        self.vertices.iter().map(|(n, w)| w * vertex[*n]).sum()
    }

    /// u and p at the point.
    pub fn read(&self, displacement: &[f64], pressure: Option<&[f64]>) -> ProbeValue {
        ProbeValue {
            displacement: self.vector(displacement),
            pressure: pressure.map_or(f64::NAN, |p| self.scalar(p)),
        }
    }
}

//! Values at a point of the body, as linear functionals of the nodal arrays.

use myovib_fem::Space;

use crate::error::ModelError;

/// A point located in its element.
#[derive(Debug, Clone)]
pub struct Probe {
    point: [f64; 2],
    nodes: Vec<(usize, f64)>,
    vertices: Vec<(usize, f64)>,
}

/// u and p at a probe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeValue {
    /// Displacement, m.
    pub displacement: [f64; 2],
    /// Pressure, Pa; NaN for a formulation without pressure.
    pub pressure: f64,
}

impl Probe {
    /// Locates a point.
    ///
    /// # Errors
    /// [`ModelError::OutsideMesh`].
    pub fn at(space: &Space, point: [f64; 2]) -> Result<Self, ModelError> {
        let [x, y] = point;
        let located = space
            .locate(point)
            .ok_or(ModelError::OutsideMesh { x, y })?;
        Ok(Self {
            point,
            nodes: space.displacement_functional(&located),
            vertices: space.pressure_functional(&located),
        })
    }

    /// The point, m.
    pub fn point(&self) -> [f64; 2] {
        self.point
    }

    /// The nodes whose values enter, with their weights.
    pub fn node_weights(&self) -> &[(usize, f64)] {
        &self.nodes
    }

    /// A displacement-like nodal array at the point.
    pub fn vector(&self, nodal: &[f64]) -> [f64; 2] {
        let component = |axis| {
            self.nodes
                .iter()
                .map(|(n, w)| w * nodal[2 * n + axis])
                .sum()
        };
        [component(0), component(1)]
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

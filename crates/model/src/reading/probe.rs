//! Values at a point of the body as linear functionals of nodal arrays.

use myovib_fem::{Barycentric, ElementPoint, Space};

use super::{locate, locate_near, place_of};
use crate::error::ModelError;

/// A point and its location in the mesh.
#[derive(Debug, Clone)]
pub struct Probe {
    point: Vec<f64>,
    located: ElementPoint,
    nodes: Vec<(usize, f64)>,
    vertices: Vec<(usize, f64)>,
}

/// Displacement u and pressure p at a probe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeValue {
    /// Displacement, m; in 2D the third component is zero.
    pub displacement: [f64; 3],
    /// Pressure, Pa; NaN for a formulation without pressure.
    pub pressure: f64,
}

impl Probe {
    /// Locates a point.
    ///
    /// # Errors
    /// [`ModelError::Coordinates`] if the number of coordinates is wrong, [`ModelError::OutsideMesh`] if no element
    /// contains the point.
    pub fn at(space: &Space, point: impl AsRef<[f64]>) -> Result<Self, ModelError> {
        let point = point.as_ref();
        Ok(Self::new(space, locate(space, point)?, point.to_vec()))
    }

    /// Locates a point. If the point is outside the mesh by at most a twentieth of the element size, a nearby point of
    /// the mesh is used instead. Also returns the distance between the two points (m).
    ///
    /// # Errors
    /// [`ModelError::Coordinates`] if the number of coordinates is wrong, [`ModelError::OutsideMesh`] if the point is
    /// too far outside the mesh.
    pub fn near(space: &Space, point: impl AsRef<[f64]>) -> Result<(Self, f64), ModelError> {
        let point = point.as_ref();
        let (located, distance) = locate_near(space, point)?;
        Ok((Self::new(space, located, point.to_vec()), distance))
    }

    /// Creates a probe at a known position in an element.
    ///
    /// # Panics
    /// Panics if the element does not exist.
    pub fn located_at(space: &Space, at: ElementPoint) -> Self {
        Self::new(space, at, place_of(space, &at))
    }

    /// Creates a probe at the centroid of an element.
    ///
    /// # Panics
    /// Panics if the element does not exist.
    pub fn in_element(space: &Space, element: usize) -> Self {
        let n = space.mesh().shape().n_vertices();
        let barycentric = Barycentric::new(&vec![1.0 / n as f64; n]);
        let at = ElementPoint { element, barycentric };
        Self::located_at(space, at)
    }

    fn new(space: &Space, located: ElementPoint, point: Vec<f64>) -> Self {
        Self {
            nodes: space.displacement_functional(&located),
            vertices: space.pressure_functional(&located),
            point,
            located,
        }
    }

    /// Returns the requested coordinates, m.
    pub fn point(&self) -> &[f64] {
        &self.point
    }

    /// Returns the location of the point in the mesh.
    pub fn located(&self) -> ElementPoint {
        self.located
    }

    /// Returns the nodes from which values are interpolated, with their weights.
    pub fn node_weights(&self) -> &[(usize, f64)] {
        &self.nodes
    }

    /// Interpolates a nodal vector field, such as the displacement, at the point. In 2D, the third component is zero.
    pub fn vector(&self, nodal: &[f64]) -> [f64; 3] {
        let dimension = self.point.len();
        let mut vector = [0.0; 3];
        for (axis, component) in vector[..dimension].iter_mut().enumerate() {
            let values = self.nodes.iter().map(|(n, w)| w * nodal[dimension * n + axis]);
            *component = values.sum();
        }
        vector
    }

    /// Interpolates a scalar field given at the vertices, such as the pressure, at the point.
    pub fn scalar(&self, vertex: &[f64]) -> f64 {
        self.vertices.iter().map(|(n, w)| w * vertex[*n]).sum()
    }

    /// Returns the displacement u and the pressure p at the point.
    pub fn read(&self, displacement: &[f64], pressure: Option<&[f64]>) -> ProbeValue {
        ProbeValue {
            displacement: self.vector(displacement),
            pressure: pressure.map_or(f64::NAN, |p| self.scalar(p)),
        }
    }
}

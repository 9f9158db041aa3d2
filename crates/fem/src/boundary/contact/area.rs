//! Area in contact.

use super::RigidContact;
use super::obstacle::dot;

/// Depth, relative to w, from which a point counts as pressed. It exceeds rounding, and its pressure is 1e-12 of the
/// pressure at w.
const TOUCHING: f64 = 1e-6;
/// Largest gap of a point in contact, as a fraction of the facet size, at a mean pressure of one shear modulus or more. It is
/// proportional to smaller pressures.
///
/// A stiff contact presses only some points of a facet, and opens others by a part of the displacement at this pressure, which is
/// of the order of the facet size times the pressure divided by the shear modulus. The limit is five times the default penetration. It
/// is small at the edge of a contact: on an incompressible body, the pressure is K √x at the distance x inside the edge and the gap
/// K x^1.5/(3G) outside of it, which exceeds the limit from a seventh to a fifth of a facet.
const CLOSED: f64 = 0.05;

impl RigidContact {
    /// Returns the undeformed area in contact, m² (length in 2D, m). A quadrature point is in contact if it is pressed, or if its
    /// gap is small for the mean pressure around the vertices of its facet.
    ///
    /// # Panics
    /// Panics if an array is too short.
    pub fn area(&self, offset: &[f64], u: &[f64]) -> f64 {
        in_dimension!(self.boundary.dimension, self.area_in(offset, u))
    }

    fn area_in<const D: usize>(&self, offset: &[f64], u: &[f64]) -> f64 {
        let boundary = &self.boundary;
        let mut pressures = vec![0.0; self.n_points()];
        self.for_each_touch::<D>(offset, u, |touch| {
            if touch.depth > TOUCHING * self.smoothing {
                pressures[touch.index] = touch.potential[1];
            }
        });
        let pressures = pressures.chunks(boundary.points.len());
        let facets = || boundary.facets.iter().zip(&self.weights).zip(pressures.clone());
        // Integrals of the linear shape functions of the vertices, and of the pressure times these.
        let mut integrals = vec![[0.0; 2]; boundary.coordinates.len() / D];
        for ((nodes, weights), pressures) in facets() {
            for ((point, weight), pressure) in boundary.points.iter().zip(weights).zip(pressures) {
                for (&vertex, value) in nodes.iter().zip(&point.barycentric) {
                    let [measure, force] = &mut integrals[vertex];
                    *measure += weight * value;
                    *force += weight * value * pressure;
                }
            }
        }
        let mut area = 0.0;
        for (((nodes, weights), pressures), modulus) in facets().zip(&self.shear_moduli) {
            let at_vertices: [f64; D] = std::array::from_fn(|i| {
                let [measure, force] = integrals[nodes[i]];
                force / measure
            });
            let measure: f64 = weights.iter().sum();
            let size = if D == 2 { measure } else { measure.sqrt() };
            for ((point, weight), pressure) in boundary.points.iter().zip(weights).zip(pressures) {
                let mean = dot(&at_vertices, &std::array::from_fn(|i| point.barycentric[i]));
                let position = boundary.sum::<D>(nodes, &point.values, u);
                let gap = self.obstacle.gap(position, offset).distance;
                let is_closed = mean > 0.0 && gap < CLOSED * size * (mean / modulus).min(1.0);
                if *pressure > 0.0 || is_closed {
                    area += weight;
                }
            }
        }
        area
    }
}

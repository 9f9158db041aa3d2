//! Area of a contact.

use super::RigidContact;
use super::obstacle::dot;

/// Depth, relative to w, from which a point counts as pressed. It is above rounding errors. The pressure at this
/// depth is 1e-12 times the pressure at w.
const TOUCHING: f64 = 1e-6;
/// Largest gap of a point in contact, as a fraction of the facet size, at a mean pressure of one shear modulus or
/// more. At smaller pressures, the limit is proportional to the pressure.
///
/// A stiff contact presses only on some points of a facet and opens at the others. The gaps at these points are a
/// fraction of the displacement at this pressure, whose order of magnitude is the facet size times the pressure
/// divided by the shear modulus. The limit is five times the default penetration. At the edge of a contact, this
/// limit is small. On an incompressible body, the pressure is K √x at a distance x inside the edge, and the gap is
/// K x^1.5/(3G) at a distance x outside the edge. This gap exceeds the limit at a distance of a seventh to a fifth
/// of a facet.
const CLOSED: f64 = 0.05;

impl RigidContact {
    /// Returns the undeformed area in contact, in m² (in 2D: the length, in m). A quadrature point is in contact
    /// if it is pressed, or if its gap is small compared with the limit for the mean pressure around the vertices
    /// of its facet.
    pub fn area(&self, offset: &[f64], u: &[f64]) -> f64 {
        in_dimension!(self.boundary.dimension, |D| {
            let boundary = &self.boundary;
            let mut pressures = vec![0.0; self.n_points()];
            self.for_each_touch::<D>(offset, u, |touch| {
                if touch.depth > TOUCHING * self.smoothing {
                    pressures[touch.index] = touch.potential[1];
                }
            });
            let pressures = pressures.chunks(boundary.points.len());
            let facets = || boundary.facets.iter().zip(&self.weights).zip(pressures.clone());
            // Integrals of the linear shape functions of the vertices, and of the pressure times these functions.
            let mut integrals = vec![[0.0; 2]; boundary.coordinates.len() / D];
            for ((nodes, weights), pressures) in facets() {
                for ((point, weight), pressure) in
                    boundary.points.iter().zip(weights).zip(pressures)
                {
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
                for ((point, weight), pressure) in
                    boundary.points.iter().zip(weights).zip(pressures)
                {
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
        })
    }
}

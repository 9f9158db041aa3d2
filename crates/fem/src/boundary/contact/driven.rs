//! Obstacles pressed on the body by a given force.

use super::RigidContact;
use super::obstacle::dot;

/// Relative error of the contact force at which the iteration stops. Smaller errors are due to rounding.
const CONVERGED: f64 = 1e-14;
/// Maximum number of iterations, and of doublings of the penetration.
const MAX_ITERATIONS: usize = 100;

/// Derivatives of the contact force F on the body along the direction of an obstacle.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenSlope {
    /// Derivative ∂F/∂u with respect to all nodal components, N/m. Its negative is the derivative of the nodal
    /// forces with respect to the displacement of the obstacle.
    pub by_nodes: Vec<f64>,
    /// Derivative with respect to the displacement of the obstacle, N/m.
    pub by_obstacle: f64,
}

impl RigidContact {
    /// Returns the displacement of the obstacle along the unit vector `direction` at which the component of the
    /// contact force along `direction` is `force`. Returns NaN if the obstacle passes by the body. For a force of
    /// zero, the obstacle only touches the body; with multipliers, it is at the distance at which the contact force
    /// becomes nonzero.
    pub fn displacement_under(&self, force: f64, direction: &[f64], u: &[f64]) -> f64 {
        in_dimension!(self.boundary.dimension, |D| {
            let direction: [f64; D] = std::array::from_fn(|i| direction[i]);
            let touching = self.first_touch(direction, u);
            if force <= 0.0 || !touching.is_finite() {
                return if touching.is_finite() { touching } else { f64::NAN };
            }
            let excess = |s: f64| {
                let [along, slope] = self.along(direction, touching + s, u);
                [along - force, slope]
            };
            let (mut low, mut high) = (0.0, self.smoothing);
            let mut doublings = 0..MAX_ITERATIONS;
            let falls_short = |[rest, _]: [f64; 2]| rest < 0.0 || rest.is_nan();
            while falls_short(excess(high)) {
                (low, high) = (high, 2.0 * high);
                if doublings.next().is_none() {
                    return f64::NAN;
                }
            }
            // Newton's method from above, with bisection as a safeguard.
            let mut s = high;
            for _ in 0..MAX_ITERATIONS {
                let [rest, slope] = excess(s);
                if rest.abs() <= CONVERGED * force {
                    break;
                }
                match rest > 0.0 {
                    true => high = s,
                    false => low = s,
                }
                let newton = s - rest / slope;
                let next = match low < newton && newton < high {
                    true => newton,
                    false => 0.5 * (low + high),
                };
                if next == s {
                    break;
                }
                s = next;
            }
            touching + s
        })
    }

    /// Returns the smallest displacement along `direction` at which the obstacle presses on the body, or infinity
    /// if it never does.
    fn first_touch<const D: usize>(&self, direction: [f64; D], u: &[f64]) -> f64 {
        let boundary = &self.boundary;
        let points = boundary.facets.iter().flat_map(|nodes| {
            let points = boundary.points.iter();
            points.map(|point| boundary.sum::<D>(nodes, &point.values, u))
        });
        let distances = points
            .enumerate()
            .filter_map(|(index, x)| self.obstacle.distance_along(x, direction, self.depth(index)));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Returns the force along `direction` at the displacement `s` of the obstacle, and the derivative of this
    /// force.
    fn along<const D: usize>(&self, direction: [f64; D], s: f64, u: &[f64]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        self.for_each_touch::<D>(&direction.map(|e| s * e), u, |touch| {
            sums[0] += touch.weight * touch.potential[1] * dot(&touch.gap.normal, &direction);
            let slope = touch.slope().map(|row| dot(&row, &direction));
            sums[1] -= touch.weight * dot(&slope, &direction);
        });
        sums
    }

    /// Returns the derivatives of the force along the unit vector `direction` at the displacement `s` of the obstacle.
    pub fn driven_slope(&self, direction: &[f64], s: f64, u: &[f64]) -> DrivenSlope {
        in_dimension!(self.boundary.dimension, |D| {
            let direction: [f64; D] = std::array::from_fn(|i| direction[i]);
            let mut by_nodes = vec![0.0; u.len()];
            self.for_each_touch::<D>(&direction.map(|e| s * e), u, |touch| {
                let slope = touch.slope().map(|row| dot(&row, &direction));
                for (&node, value) in self.boundary.facets[touch.facet].iter().zip(touch.values) {
                    let factor = touch.weight * value;
                    for (sum, slope) in by_nodes[D * node..].iter_mut().zip(slope) {
                        *sum += factor * slope;
                    }
                }
            });
            DrivenSlope { by_nodes, by_obstacle: self.along(direction, s, u)[1] }
        })
    }
}

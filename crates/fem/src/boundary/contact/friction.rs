//! Regularized Coulomb friction.

use super::obstacle::dot;
use super::{RigidContact, Touch};

/// Friction that resists the slip velocity w with the traction μ φ' w/√(|w|² + v₀²) per undeformed area. The slip
/// velocity is the tangential velocity of the body relative to the obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Friction coefficient μ.
    pub coefficient: f64,
    /// Regularization velocity v₀, m/s. If the traction is below μ φ', the body slips slowly instead of sticking.
    pub slip_velocity: f64,
}

/// Motion of a body and an obstacle.
#[derive(Debug, Clone, Copy)]
pub struct Sliding<'a> {
    /// Displacement of the obstacle, m.
    pub offset: &'a [f64],
    /// Velocity of the obstacle, m/s.
    pub velocity: &'a [f64],
    /// Displacement of all nodes, m.
    pub u: &'a [f64],
    /// Velocity of all nodes, m/s.
    pub v: &'a [f64],
}

/// Sums over all points of a contact with friction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrictionSums {
    /// Force of the body on the obstacle, N (N/m in 2D). Unused components are zero.
    pub force: [f64; 3],
    /// Dissipated power, W (W/m in 2D).
    pub dissipation: f64,
}

/// Slip at a quadrature point.
struct Slip<'a, const D: usize> {
    touch: &'a Touch<'a, D>,
    /// Slip velocity w.
    tangential: [f64; D],
    /// Normal component of the relative velocity.
    normal: f64,
    /// The speed √(|w|² + v₀²).
    speed: f64,
    /// The factor μ φ'/√(|w|² + v₀²).
    factor: f64,
}

impl<const D: usize> Slip<'_, D> {
    /// Returns the derivatives of the resisting traction with respect to position and velocity.
    fn slopes(&self, friction: &Friction) -> [[[f64; D]; D]; 2] {
        let gap = &self.touch.gap;
        let (n, a, w) = (gap.normal, gap.axis, self.tangential);
        let square = self.speed * self.speed;
        let growth = friction.coefficient * self.touch.potential[2] / self.speed;
        let mut slopes = [[[0.0; D]; D]; 2];
        for i in 0..D {
            for k in 0..D {
                let tangential = f64::from(u8::from(i == k)) - n[i] * n[k];
                let bent = gap.curvature * (tangential - a[i] * a[k]);
                let bent_slip = gap.curvature * (w[k] - a[k] * dot(&a, &w));
                let turned = self.normal * (bent - w[i] * bent_slip / square) + n[i] * bent_slip;
                slopes[0][i][k] = -growth * w[i] * n[k] - self.factor * turned;
                slopes[1][i][k] = self.factor * (tangential - w[i] * w[k] / square);
            }
        }
        slopes
    }
}

impl RigidContact {
    /// Adds the friction force of the body on the obstacle to `total`.
    pub fn add_friction(&self, friction: &Friction, sliding: &Sliding<'_>, total: &mut [f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            self.for_each_slip::<D>(friction, sliding, |slip| {
                let nodes = &self.boundary.facets[slip.touch.facet];
                for (&node, value) in nodes.iter().zip(slip.touch.values) {
                    let factor = slip.factor * slip.touch.weight * value;
                    for (total, w) in total[D * node..].iter_mut().zip(slip.tangential) {
                        *total += factor * w;
                    }
                }
            });
        })
    }

    /// Adds the derivatives of [`add_friction`](Self::add_friction) with respect to the free components of
    /// displacement and velocity to `values`.
    ///
    /// # Shapes
    /// Each array of `values` holds the entries of
    /// [`Solid::displacement_pattern`](crate::Solid::displacement_pattern).
    pub fn add_friction_slopes(
        &self,
        friction: &Friction,
        sliding: &Sliding<'_>,
        values: [&mut [f64]; 2],
    ) {
        in_dimension!(self.boundary.dimension, |D| {
            let [by_displacement, by_velocity] = values;
            self.for_each_slip::<D>(friction, sliding, |slip| {
                let [by_position, by_slip] = slip.slopes(friction);
                self.add_block(slip.touch, &by_position, by_displacement);
                self.add_block(slip.touch, &by_slip, by_velocity);
            });
        })
    }

    /// Returns the friction force on the whole boundary and the power that it dissipates.
    pub fn friction_sums(&self, friction: &Friction, sliding: &Sliding<'_>) -> FrictionSums {
        in_dimension!(self.boundary.dimension, |D| {
            let mut sums = FrictionSums::default();
            self.for_each_slip::<D>(friction, sliding, |slip| {
                let factor = slip.touch.weight * slip.factor;
                for (force, w) in sums.force.iter_mut().zip(slip.tangential) {
                    *force += factor * w;
                }
                sums.dissipation += factor * dot(&slip.tangential, &slip.tangential);
            });
            sums
        })
    }

    fn for_each_slip<const D: usize>(
        &self,
        friction: &Friction,
        sliding: &Sliding<'_>,
        mut kernel: impl FnMut(&Slip<'_, D>),
    ) {
        self.for_each_touch::<D>(sliding.offset, sliding.u, |touch| {
            let mut relative: [f64; D] = std::array::from_fn(|i| -sliding.velocity[i]);
            let nodes = &self.boundary.facets[touch.facet];
            for (&node, value) in nodes.iter().zip(touch.values) {
                for (sum, v) in relative.iter_mut().zip(&sliding.v[D * node..]) {
                    *sum += value * v;
                }
            }
            let n = touch.gap.normal;
            let normal = dot(&relative, &n);
            let tangential: [f64; D] = std::array::from_fn(|i| relative[i] - normal * n[i]);
            let speed = dot(&tangential, &tangential).sqrt().hypot(friction.slip_velocity);
            kernel(&Slip {
                touch,
                tangential,
                normal,
                speed,
                factor: friction.coefficient * touch.potential[1] / speed,
            });
        });
    }
}

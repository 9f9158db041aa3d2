//! Shapes of rigid obstacles and distances from them.

/// Shape of a rigid obstacle. In 2D, the third coordinates are ignored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Obstacle {
    /// Half-space bounded by a plane.
    Plane {
        /// Point on the plane, m.
        point: [f64; 3],
        /// Unit normal that points out of the obstacle.
        normal: [f64; 3],
    },
    /// Ball, or a disk in 2D.
    Sphere {
        /// Center, m.
        center: [f64; 3],
        /// Radius, m.
        radius: f64,
    },
    /// Infinite cylinder.
    Cylinder {
        /// Point on the axis, m.
        point: [f64; 3],
        /// Unit vector along the axis.
        axis: [f64; 3],
        /// Radius, m.
        radius: f64,
    },
}

/// Distance g of a point from an obstacle, with its derivatives n = ∇g and ∇∇g = `curvature` (I − n⊗n − a⊗a).
pub(super) struct Gap<const D: usize> {
    pub(super) distance: f64,
    pub(super) normal: [f64; D],
    /// Direction a in which the obstacle is not curved. Zero except for a cylinder.
    pub(super) axis: [f64; D],
    pub(super) curvature: f64,
}

impl Obstacle {
    /// Returns the gap between the point `x` and the obstacle displaced by `offset`.
    pub(super) fn gap<const D: usize>(&self, x: [f64; D], offset: &[f64]) -> Gap<D> {
        let from =
            |point: &[f64; 3]| -> [f64; D] { std::array::from_fn(|i| x[i] - point[i] - offset[i]) };
        let none = [0.0; D];
        match self {
            Self::Plane { point, normal } => {
                let normal = std::array::from_fn(|i| normal[i]);
                Gap { distance: dot(&from(point), &normal), normal, axis: none, curvature: 0.0 }
            }
            Self::Sphere { center, radius } => round(from(center), none, *radius),
            Self::Cylinder { point, axis, radius } => {
                let axis: [f64; D] = std::array::from_fn(|i| axis[i]);
                let mut from = from(point);
                let along = dot(&from, &axis);
                (0..D).for_each(|i| from[i] -= along * axis[i]);
                round(from, axis, *radius)
            }
        }
    }

    /// Returns the distance that the obstacle moves along the unit vector `direction` until its gap to the point
    /// `x` is `gap`, or `None` if it does not reach this gap.
    pub(super) fn distance_along<const D: usize>(
        &self,
        x: [f64; D],
        direction: [f64; D],
        gap: f64,
    ) -> Option<f64> {
        let from = |point: &[f64; 3]| -> [f64; D] { std::array::from_fn(|i| x[i] - point[i]) };
        match self {
            Self::Plane { point, normal } => {
                let normal = std::array::from_fn(|i| normal[i]);
                let speed = dot(&direction, &normal);
                (speed > 0.0).then(|| (dot(&from(point), &normal) - gap) / speed)
            }
            Self::Sphere { center, radius } => first_root(from(center), direction, radius + gap),
            Self::Cylinder { point, axis, radius } => {
                let axis: [f64; D] = std::array::from_fn(|i| axis[i]);
                let across = |v: [f64; D]| -> [f64; D] {
                    let along = dot(&v, &axis);
                    std::array::from_fn(|i| v[i] - along * axis[i])
                };
                first_root(across(from(point)), across(direction), radius + gap)
            }
        }
    }
}

/// Returns the smaller root s of |`from` − s `direction`| = `radius`.
fn first_root<const D: usize>(from: [f64; D], direction: [f64; D], radius: f64) -> Option<f64> {
    let (speed, along) = (dot(&direction, &direction), dot(&from, &direction));
    let rest = along * along - speed * (dot(&from, &from) - radius * radius);
    (speed > 0.0 && rest >= 0.0).then(|| (along - rest.sqrt()) / speed)
}

/// Returns the gap at the position `from` relative to the center or to the nearest point of the axis.
fn round<const D: usize>(from: [f64; D], axis: [f64; D], radius: f64) -> Gap<D> {
    // At the center itself, the normal is zero.
    let length = dot(&from, &from).sqrt().max(f64::EPSILON * radius);
    Gap {
        distance: length - radius,
        normal: from.map(|r| r / length),
        axis,
        curvature: 1.0 / length,
    }
}

pub(super) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

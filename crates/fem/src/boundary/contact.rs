//! Contact of a boundary with a rigid obstacle, by a penalty.

use crate::boundary::deformed::DeformedFacets;
use crate::boundary::facet::{area_vector, outward_facets, owners};
use crate::error::FemError;
use crate::solid::Solid;

/// Default stiffness times facet size, in shear moduli of the body: at a contact pressure of one shear modulus the
/// penetration is a hundredth of a facet.
const DEFAULT_STIFFNESS: f64 = 100.0;
/// Depth over which the stiffness sets in, as a fraction of the facet size.
const SMOOTHING: f64 = 1e-3;

/// Shape of a rigid obstacle; in the plane without third coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Obstacle {
    /// Half-space behind a plane.
    Plane {
        /// Point of the plane, m.
        point: [f64; 3],
        /// Unit normal that points out of the obstacle.
        normal: [f64; 3],
    },
    /// Ball, in the plane a disk.
    Sphere {
        /// Center, m.
        center: [f64; 3],
        /// Radius, m.
        radius: f64,
    },
    /// Infinite cylinder.
    Cylinder {
        /// Point of the axis, m.
        point: [f64; 3],
        /// Unit vector along the axis.
        axis: [f64; 3],
        /// Radius, m.
        radius: f64,
    },
}

/// Distance g of a point from an obstacle, with its derivatives n = ∇g and ∇∇g = `curvature` (I − n⊗n − a⊗a).
struct Gap<const D: usize> {
    distance: f64,
    normal: [f64; D],
    /// Direction a without curvature; zero except for a cylinder.
    axis: [f64; D],
    curvature: f64,
}

impl Obstacle {
    /// Returns the gap of the point `x` to the obstacle displaced by `offset`.
    fn gap<const D: usize>(&self, x: [f64; D], offset: &[f64]) -> Gap<D> {
        let from =
            |point: &[f64; 3]| -> [f64; D] { std::array::from_fn(|i| x[i] - point[i] - offset[i]) };
        let none = [0.0; D];
        match self {
            Self::Plane { point, normal } => {
                let normal = std::array::from_fn(|i| normal[i]);
                Gap {
                    distance: dot(&from(point), &normal),
                    normal,
                    axis: none,
                    curvature: 0.0,
                }
            }
            Self::Sphere { center, radius } => round(from(center), none, *radius),
            Self::Cylinder {
                point,
                axis,
                radius,
            } => {
                let axis: [f64; D] = std::array::from_fn(|i| axis[i]);
                let mut from = from(point);
                let along = dot(&from, &axis);
                (0..D).for_each(|i| from[i] -= along * axis[i]);
                round(from, axis, *radius)
            }
        }
    }
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

/// Frictionless contact of a boundary group with a rigid obstacle, of the energy ∫ φ(−g) dS over the undeformed
/// boundary, with the gap g at the deformed point:
///
/// ```text
/// φ(s) = 0 for s < 0,   k s³/(6 w) for s < w,   k (s² − w s + w²/3)/2 beyond
/// ```
///
/// The contact pressure φ' per undeformed area has a continuous derivative. It acts along the normal of the obstacle.
///
/// # Shapes
/// Forces and displacements have length `n_components`; displacements of the obstacle have D components.
///
/// # Units
/// k in Pa/m; forces in N, in 2D in N/m.
#[derive(Debug, Clone)]
pub struct RigidContact {
    boundary: DeformedFacets,
    /// Quadrature weights of the points of each facet, including the undeformed measure.
    weights: Vec<Vec<f64>>,
    /// As in [`DeformedFacets::matrix_indices`].
    indices: Vec<Vec<Option<u32>>>,
    obstacle: Obstacle,
    stiffness: f64,
    /// Depth w.
    smoothing: f64,
}

/// Sums over a contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactSums {
    /// Force on the body, N, in 2D in N/m; unused components are zero.
    pub force: [f64; 3],
    /// Undeformed area of the points in contact, m², in 2D the length, m.
    pub area: f64,
    /// Largest penetration, m.
    pub penetration: f64,
}

/// A quadrature point in contact.
struct Touch<'a, const D: usize> {
    facet: usize,
    /// Values of the shape functions.
    values: &'a [f64],
    weight: f64,
    gap: Gap<D>,
    /// φ' and φ''.
    pressure: [f64; 2],
}

impl RigidContact {
    /// Creates the contact of a group of edges of triangles or faces of tetrahedra. The default of
    /// the `stiffness` follows from the shear moduli and facets of the group.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`]; [`FemError::WrongGroup`] if the group has other members;
    /// [`FemError::InteriorFacet`] for a member with elements on both sides.
    pub fn new(
        solid: &Solid,
        group: &str,
        obstacle: Obstacle,
        stiffness: Option<f64>,
    ) -> Result<Self, FemError> {
        let space = solid.space();
        let boundary = DeformedFacets::new(space, &outward_facets(space, group)?);
        let weights = match boundary.dimension {
            2 => weights::<2>(&boundary),
            _ => weights::<3>(&boundary),
        };
        let area: f64 = weights.iter().flatten().sum();
        let mean = area / weights.len().max(1) as f64;
        let size = if boundary.dimension == 2 {
            mean
        } else {
            mean.sqrt()
        };
        let owners = owners(space.mesh(), group)?;
        let moduli = owners
            .iter()
            .map(|&element| solid.mean_factor(element) * solid.laws()[element].moduli()[1]);
        let shear_modulus = moduli.fold(0.0, f64::max);
        Ok(Self {
            indices: boundary.matrix_indices(solid),
            weights,
            boundary,
            obstacle,
            stiffness: stiffness.unwrap_or(DEFAULT_STIFFNESS * shear_modulus / size),
            smoothing: SMOOTHING * size,
        })
    }

    /// Returns k, Pa/m.
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// Returns the depth w over which the stiffness sets in, m.
    pub fn smoothing(&self) -> f64 {
        self.smoothing
    }

    /// Returns φ' and φ'' at the penetration `s` > 0.
    fn pressure(&self, s: f64) -> [f64; 2] {
        let (k, w) = (self.stiffness, self.smoothing);
        match s < w {
            true => [0.5 * k * s * s / w, k * s / w],
            false => [k * (s - 0.5 * w), k],
        }
    }

    /// Calls `kernel` at each quadrature point in contact.
    fn for_each_touch<const D: usize>(
        &self,
        offset: &[f64],
        u: &[f64],
        mut kernel: impl FnMut(&Touch<'_, D>),
    ) {
        for (facet, nodes) in self.boundary.facets.iter().enumerate() {
            for (point, &weight) in self.boundary.points.iter().zip(&self.weights[facet]) {
                let gap = self
                    .obstacle
                    .gap::<D>(self.boundary.sum(nodes, &point.values, u), offset);
                if gap.distance < 0.0 {
                    kernel(&Touch {
                        facet,
                        values: &point.values[..nodes.len()],
                        weight,
                        pressure: self.pressure(-gap.distance),
                        gap,
                    });
                }
            }
        }
    }

    /// Adds `sign` times the force of the obstacle, displaced by `offset`, on the body at displacement `u` to `total`.
    ///
    /// # Panics
    /// Panics if an array is too short.
    pub fn add_force(&self, offset: &[f64], sign: f64, u: &[f64], total: &mut [f64]) {
        match self.boundary.dimension {
            2 => self.add_force_in::<2>(offset, sign, u, total),
            _ => self.add_force_in::<3>(offset, sign, u, total),
        }
    }

    fn add_force_in<const D: usize>(
        &self,
        offset: &[f64],
        sign: f64,
        u: &[f64],
        total: &mut [f64],
    ) {
        self.for_each_touch::<D>(offset, u, |touch| {
            for (&node, value) in self.boundary.facets[touch.facet].iter().zip(touch.values) {
                let factor = sign * touch.pressure[0] * touch.weight * value;
                for (total, normal) in total[D * node..].iter_mut().zip(touch.gap.normal) {
                    *total += factor * normal;
                }
            }
        });
    }

    /// Adds the derivative of the force with respect to the free components of `u` to `values`:
    /// ∫ (−φ'' n⊗n + φ' ∇∇g) φ_a φ_b dS.
    ///
    /// # Shapes
    /// `values` holds the entries of [`Solid::displacement_pattern`].
    ///
    /// # Panics
    /// Panics if an array is too short.
    pub fn add_stiffness(&self, offset: &[f64], u: &[f64], values: &mut [f64]) {
        match self.boundary.dimension {
            2 => self.add_stiffness_in::<2>(offset, u, values),
            _ => self.add_stiffness_in::<3>(offset, u, values),
        }
    }

    fn add_stiffness_in<const D: usize>(&self, offset: &[f64], u: &[f64], values: &mut [f64]) {
        self.for_each_touch::<D>(offset, u, |touch| {
            let ([pressure, slope], gap) = (touch.pressure, &touch.gap);
            let bent = pressure * gap.curvature;
            let (n, a) = (gap.normal, gap.axis);
            let block: [[f64; D]; D] = std::array::from_fn(|i| {
                std::array::from_fn(|k| {
                    let unit = f64::from(u8::from(i == k));
                    bent * (unit - n[i] * n[k] - a[i] * a[k]) - slope * n[i] * n[k]
                })
            });
            let indices = &self.indices[touch.facet];
            let columns = D * touch.values.len();
            for (a, value_a) in touch.values.iter().enumerate() {
                for (b, value_b) in touch.values.iter().enumerate() {
                    let factor = touch.weight * value_a * value_b;
                    for (i, row) in block.iter().enumerate() {
                        for (k, entry) in row.iter().enumerate() {
                            if let Some(index) = indices[(D * a + i) * columns + D * b + k] {
                                values[index as usize] += factor * entry;
                            }
                        }
                    }
                }
            }
        });
    }

    /// Returns force, area and penetration at displacement `u`.
    ///
    /// # Panics
    /// Panics if an array is too short.
    pub fn sums(&self, offset: &[f64], u: &[f64]) -> ContactSums {
        match self.boundary.dimension {
            2 => self.sums_in::<2>(offset, u),
            _ => self.sums_in::<3>(offset, u),
        }
    }

    fn sums_in<const D: usize>(&self, offset: &[f64], u: &[f64]) -> ContactSums {
        let mut sums = ContactSums::default();
        self.for_each_touch::<D>(offset, u, |touch| {
            for (force, normal) in sums.force.iter_mut().zip(touch.gap.normal) {
                *force += touch.weight * touch.pressure[0] * normal;
            }
            sums.area += touch.weight;
            sums.penetration = sums.penetration.max(-touch.gap.distance);
        });
        sums
    }
}

/// Returns the quadrature weights of each facet with the undeformed measure.
fn weights<const D: usize>(boundary: &DeformedFacets) -> Vec<Vec<f64>> {
    let rest = vec![0.0; boundary.coordinates.len()];
    let mut weights = vec![Vec::with_capacity(boundary.points.len()); boundary.facets.len()];
    boundary.for_each_point::<D>(&rest, |facet, point, [s, t]| {
        let normal = area_vector(s, t);
        weights[facet].push(point.weight * dot(&normal, &normal).sqrt());
    });
    weights
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::dofs::DofMap;
    use crate::material::Law;
    use crate::mesh::generate;
    use crate::space::Space;

    const STRETCH: f64 = 1e-3;

    fn block(dimension: usize) -> Solid {
        let mesh = match dimension {
            2 => generate::rectangle([0.0; 2], [0.1; 2], [2, 2]).unwrap(),
            _ => generate::block([0.0; 3], [0.1; 3], [2, 2, 2]).unwrap(),
        };
        let space = Arc::new(Space::taylor_hood(&mesh));
        let dofs = DofMap::clamped(&space, &[]).unwrap();
        let law = Law::MooneyRivlin { c10: 1e4, c01: 0.0 };
        Solid::uniform(space, dofs, law, 1e3).unwrap()
    }

    fn obstacles(dimension: usize) -> Vec<Obstacle> {
        let (center, normal) = match dimension {
            2 => ([0.04, 0.13, 0.0], [0.6, -0.8, 0.0]),
            _ => ([0.04, 0.05, 0.13], [0.0, 0.6, -0.8]),
        };
        let mut all = vec![
            Obstacle::Plane {
                point: center.map(|x| 0.75 * x),
                normal,
            },
            Obstacle::Sphere {
                center,
                radius: 0.05,
            },
        ];
        if dimension == 3 {
            all.push(Obstacle::Cylinder {
                point: center,
                axis: [0.8, 0.6, 0.0],
                radius: 0.05,
            });
        }
        all
    }

    /// A deformation without symmetry.
    fn deformed(solid: &Solid) -> Vec<f64> {
        let n = solid.dofs().n_full();
        (0..n).map(|i| STRETCH * (1.3 * i as f64).sin()).collect()
    }

    /// The stiffness is the derivative of the force. Forces of 10 N have a rounding error of 1e-15, so their quotients
    /// by 1e-8 m have errors of 1e-6 N/m, at stiffnesses above 1e3 N/m.
    #[test]
    fn the_stiffness_is_the_derivative_of_the_force() {
        for dimension in [2, 3] {
            let solid = block(dimension);
            let u = deformed(&solid);
            for obstacle in obstacles(dimension) {
                let contact = RigidContact::new(&solid, "top", obstacle, None).unwrap();
                let offset = [2e-3, -1e-3, 1e-3];
                let pattern = solid.displacement_pattern();
                let mut values = vec![0.0; pattern.nnz()];
                contact.add_stiffness(&offset, &u, &mut values);
                let force = |u: &[f64]| {
                    let mut force = vec![0.0; u.len()];
                    contact.add_force(&offset, 1.0, u, &mut force);
                    force
                };
                assert!(force(&u).iter().any(|f| *f != 0.0), "{obstacle:?}");
                let scale = values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let mut starts = 0;
                for column in 0..u.len() {
                    let step = 1e-8;
                    let shifted = |step: f64| {
                        let mut u = u.clone();
                        u[column] += step;
                        force(&u)
                    };
                    let (plus, minus) = (shifted(step), shifted(-step));
                    for &row in pattern.lane(column) {
                        let difference = (plus[row] - minus[row]) / (2.0 * step);
                        let found = values[starts];
                        starts += 1;
                        assert!(
                            (found - difference).abs() < 1e-7 * scale,
                            "{obstacle:?} {row} {column}: {found} {difference}"
                        );
                    }
                }
            }
        }
    }

    /// Nodal forces add up to the sums, and the pressure of a flat contact follows from its penetration.
    #[test]
    fn a_plane_presses_with_the_pressure_of_its_penetration() {
        for dimension in [2, 3] {
            let solid = block(dimension);
            let up = dimension - 1;
            let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
            (point[up], normal[up]) = (0.1, -1.0);
            let plane = Obstacle::Plane { point, normal };
            let contact = RigidContact::new(&solid, "top", plane, Some(1e6)).unwrap();
            let u = vec![0.0; solid.dofs().n_full()];
            let mut offset = [0.0; 3];
            offset[up] = -1e-3;
            let sums = contact.sums(&offset, &u);
            let area = 0.1_f64.powi(up as i32);
            // The stiffness sets in over a thousandth of the size of a facet.
            let size = if dimension == 2 {
                0.05
            } else {
                0.05 / 2_f64.sqrt()
            };
            let expected = -1e6 * (1e-3 - 0.5e-3 * size) * area;
            assert!((sums.force[up] - expected).abs() < 1e-12 * expected.abs());
            assert!((sums.area - area).abs() < 1e-14);
            assert!((sums.penetration - 1e-3).abs() < 1e-15);
            let mut total = vec![0.0; u.len()];
            contact.add_force(&offset, 1.0, &u, &mut total);
            let sum: f64 = total.iter().skip(up).step_by(dimension).sum();
            assert!((sum - expected).abs() < 1e-12 * expected.abs());
        }
    }
}

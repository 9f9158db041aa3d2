//! Contact of a boundary with a rigid obstacle, enforced by a penalty.

mod area;
mod driven;
mod friction;
mod obstacle;

use crate::boundary::deformed::DeformedFacets;
use crate::boundary::facet::{area_vector, owners};
use crate::error::FemError;
use crate::solid::Solid;
pub use driven::DrivenSlope;
pub use friction::{Friction, FrictionSums, Sliding};
pub use obstacle::Obstacle;
use obstacle::{Gap, dot};

/// Default stiffness times facet size, in units of the shear modulus of the body. At a contact pressure of one
/// shear modulus, the penetration is a hundredth of the facet size.
const DEFAULT_STIFFNESS: f64 = 100.0;
/// Penetration at which the full stiffness is reached, as a fraction of the facet size.
const SMOOTHING: f64 = 1e-3;
/// Accepted mean distance from the obstacle with augmented Lagrange multipliers, as a fraction of the facet size.
/// At a contact pressure of one shear modulus, the default penalty penetrates a hundred times deeper.
const AUGMENTED: f64 = 1e-4;
/// Cosine of the largest angle between an outward normal of the body and the normal of an obstacle on the wrong
/// side of the body.
const AWAY: f64 = 0.5;

/// Contact of a boundary group with a rigid obstacle. Its energy is ∫ φ(−g) dS over the undeformed boundary, where
/// g is the gap at the deformed point:
///
/// ```text
/// φ(s) = 0 for s < 0,   k s³/(6 w) for s < w,   k (s² − w s + w²/3)/2 beyond
/// ```
///
/// The contact pressure φ' per undeformed area has a continuous derivative and acts along the normal of the
/// obstacle. [`Friction`] is added separately.
///
/// With augmented Lagrange multipliers, φ(d − g) − φ(d) replaces φ(−g). Each quadrature point has a depth d ≥ 0.
/// The multiplier is φ'(d), the pressure at zero gap. The energy of an open contact is then negative.
///
/// # Shapes
/// Forces and displacements have length `n_components`; displacements of the obstacle have one component per
/// dimension. Methods panic if an array is too short.
///
/// # Units
/// k is in Pa/m; forces are in N (N/m in 2D).
#[derive(Debug, Clone)]
pub struct RigidContact {
    boundary: DeformedFacets,
    /// Quadrature weights of the points of each facet. They include the undeformed measure.
    weights: Vec<Vec<f64>>,
    /// Indices of matrix entries as in [`DeformedFacets::matrix_indices`].
    indices: Vec<Vec<Option<u32>>>,
    obstacle: Obstacle,
    stiffness: f64,
    /// Shear modulus (Pa) of the element of each facet.
    shear_moduli: Vec<f64>,
    /// Smoothing depth w.
    smoothing: f64,
    /// Depth d (m) of each point of each facet. Empty without multipliers.
    depths: Vec<f64>,
}

/// Sums over all points of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactSums {
    /// Force on the body, N (N/m in 2D). Unused components are zero.
    pub force: [f64; 3],
    /// Stored energy, J (J/m in 2D).
    pub energy: f64,
    /// Largest penetration, m.
    pub penetration: f64,
}

/// A quadrature point in contact.
struct Touch<'a, const D: usize> {
    facet: usize,
    /// Index of the point among all facets.
    index: usize,
    /// The difference d − g.
    depth: f64,
    /// Values of the shape functions at the point.
    values: &'a [f64],
    weight: f64,
    gap: Gap<D>,
    /// The values φ, φ' and φ''.
    potential: [f64; 3],
}

impl<const D: usize> Touch<'_, D> {
    /// Returns the derivative of the pressure vector φ' n with respect to the position.
    fn slope(&self) -> [[f64; D]; D] {
        let ([_, pressure, slope], gap) = (self.potential, &self.gap);
        let bent = pressure * gap.curvature;
        let (n, a) = (gap.normal, gap.axis);
        std::array::from_fn(|i| {
            std::array::from_fn(|k| {
                let unit = f64::from(u8::from(i == k));
                bent * (unit - n[i] * n[k] - a[i] * a[k]) - slope * n[i] * n[k]
            })
        })
    }
}

impl RigidContact {
    /// Creates the contact of a group of edges of triangles or faces of tetrahedra. The default `stiffness` is
    /// computed from the shear moduli and facet sizes of the group.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, [`FemError::WrongGroup`] if its members are
    /// of another kind, or [`FemError::InteriorFacet`] if a member has elements on both sides.
    pub fn new(
        solid: &Solid,
        group: &str,
        obstacle: Obstacle,
        stiffness: Option<f64>,
    ) -> Result<Self, FemError> {
        let space = solid.space();
        let boundary = DeformedFacets::of_group(space, group)?;
        let weights = in_dimension!(boundary.dimension, |D| weights::<D>(&boundary));
        let area: f64 = weights.iter().flatten().sum();
        let mean = area / weights.len().max(1) as f64;
        let size = if boundary.dimension == 2 { mean } else { mean.sqrt() };
        let owners = owners(space.mesh(), group)?;
        let modulus =
            |&element: &usize| solid.mean_factor(element) * solid.laws()[element].moduli()[1];
        let shear_moduli: Vec<f64> = owners.iter().map(modulus).collect();
        let largest = shear_moduli.iter().copied().fold(0.0, f64::max);
        Ok(Self {
            indices: boundary.matrix_indices(solid),
            weights,
            boundary,
            obstacle,
            stiffness: stiffness.unwrap_or(DEFAULT_STIFFNESS * largest / size),
            shear_moduli,
            smoothing: SMOOTHING * size,
            depths: Vec::new(),
        })
    }

    /// Sets the depths d of augmented Lagrange multipliers.
    ///
    /// # Panics
    /// Panics if the number of depths is not [`n_points`](Self::n_points).
    pub fn set_depths(&mut self, depths: Vec<f64>) {
        assert_eq!(depths.len(), self.n_points());
        self.depths = depths;
    }

    /// Returns the depths d (m) of the multipliers. The slice is empty without multipliers.
    pub fn depths(&self) -> &[f64] {
        &self.depths
    }

    /// Returns the number of quadrature points.
    pub fn n_points(&self) -> usize {
        self.weights.iter().map(Vec::len).sum()
    }

    /// Returns the mean distance from the obstacle at displacement `u`, weighted by the contact pressure. The
    /// result is relative to the accepted distance with multipliers, 1e-4 of the facet size, and it is 0 without
    /// contact. Individual points penetrate deeper, because quadratic facets do not follow the shape of the
    /// obstacle at the edge of the contact.
    pub fn distance(&self, offset: &[f64], u: &[f64]) -> f64 {
        in_dimension!(self.boundary.dimension, |D| {
            let (mut force, mut force_times_distance) = (0.0, 0.0);
            self.for_each_touch::<D>(offset, u, |touch| {
                let point_force = touch.weight * touch.potential[1];
                force += point_force;
                force_times_distance += point_force * touch.gap.distance.abs();
            });
            match force > 0.0 {
                true => force_times_distance / (AUGMENTED * self.facet_size() * force),
                false => 0.0,
            }
        })
    }

    /// Sets the multipliers to the contact pressures at displacement `u` (Uzawa's method).
    pub fn update_multipliers(&mut self, offset: &[f64], u: &[f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            let mut depths = vec![0.0; self.depths.len()];
            self.for_each_touch::<D>(offset, u, |touch| depths[touch.index] = touch.depth);
            self.depths = depths;
        });
    }

    /// Multiplies the stiffness by `factor` and adapts the multipliers, so that the contact pressures at
    /// displacement `u` do not change.
    ///
    /// # Panics
    /// Panics if an array is too short, or if the contact has no multipliers.
    pub fn scale_stiffness(&mut self, factor: f64, offset: &[f64], u: &[f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            let (k, w) = (factor * self.stiffness, self.smoothing);
            let mut depths = vec![0.0; self.depths.len()];
            self.for_each_touch::<D>(offset, u, |touch| {
                let pressure = touch.potential[1];
                let depth = match pressure < 0.5 * k * w {
                    true => (2.0 * w * pressure / k).sqrt(),
                    false => pressure / k + 0.5 * w,
                };
                depths[touch.index] = touch.gap.distance + depth;
            });
            (self.stiffness, self.depths) = (k, depths);
        });
    }

    /// Returns the penalty stiffness k, Pa/m.
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// Returns the mean length (m) of the facets; in 3D, the square root of their mean area.
    pub fn facet_size(&self) -> f64 {
        self.smoothing / SMOOTHING
    }

    /// Returns the unit vector from the obstacle to the nearest point of the undeformed group. In 2D, the third
    /// component is zero.
    pub fn toward_body(&self) -> [f64; 3] {
        in_dimension!(self.boundary.dimension, |D| {
            let (boundary, rest) = (&self.boundary, vec![0.0; self.boundary.coordinates.len()]);
            let places = boundary.facets.iter().flat_map(|nodes| {
                let inside = boundary.points.iter();
                let inside = inside.map(|point| boundary.sum::<D>(nodes, &point.values, &rest));
                // Nodes are included because a pole of the body is often a node.
                let at_nodes = nodes.iter();
                inside.chain(at_nodes.map(|node| boundary.coordinates.as_chunks().0[*node]))
            });
            let gaps = places.map(|x| self.obstacle.gap(x, &[0.0; D]));
            let nearest = gaps.min_by(|a, b| a.distance.total_cmp(&b.distance));
            let mut normal = [0.0; 3];
            normal[..D].copy_from_slice(&nearest.map_or([0.0; D], |gap| gap.normal));
            normal
        })
    }

    /// Returns whether all normals of the obstacle at the undeformed group are within 60° of the outward normals
    /// of the facets. In this case, a facet must rotate by more than 30° before the obstacle can press on it. The
    /// limit is below 90°, because walls perpendicular to a plane may bulge against it.
    ///
    /// # Panics
    /// Panics if the `offset` of the obstacle is too short.
    pub fn faces_away(&self, offset: &[f64]) -> bool {
        in_dimension!(self.boundary.dimension, |D| {
            let (boundary, rest) = (&self.boundary, vec![0.0; self.boundary.coordinates.len()]);
            let mut least = f64::INFINITY;
            boundary.for_each_point::<D>(&rest, |facet, point, [s, t]| {
                let x = boundary.sum::<D>(&boundary.facets[facet], &point.values, &rest);
                let outward = area_vector(s, t);
                let length = dot(&outward, &outward).sqrt();
                least = least.min(dot(&self.obstacle.gap(x, offset).normal, &outward) / length);
            });
            least > AWAY
        })
    }

    /// Adds the rate of the force on the body to `total`. `obstacle` holds the displacement and the velocity of
    /// the obstacle, and `body` holds the displacements and velocities of all nodes.
    pub fn add_force_rate(&self, obstacle: [&[f64]; 2], body: [&[f64]; 2], total: &mut [f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            let ([offset, velocity], [u, v]) = (obstacle, body);
            self.for_each_touch::<D>(offset, u, |touch| {
                let nodes = &self.boundary.facets[touch.facet];
                let mut relative: [f64; D] = std::array::from_fn(|i| -velocity[i]);
                for (&node, value) in nodes.iter().zip(touch.values) {
                    for (sum, v) in relative.iter_mut().zip(&v[D * node..]) {
                        *sum += value * v;
                    }
                }
                let rate = touch.slope().map(|row| touch.weight * dot(&row, &relative));
                for (&node, value) in nodes.iter().zip(touch.values) {
                    for (total, rate) in total[D * node..].iter_mut().zip(rate) {
                        *total += value * rate;
                    }
                }
            });
        })
    }

    /// Returns φ, φ' and φ'' at `s` ≥ 0.
    fn potential(&self, s: f64) -> [f64; 3] {
        let (k, w) = (self.stiffness, self.smoothing);
        match s < w {
            true => [k * s.powi(3) / (6.0 * w), 0.5 * k * s * s / w, k * s / w],
            false => [0.5 * k * (s * (s - w) + w * w / 3.0), k * (s - 0.5 * w), k],
        }
    }

    /// Returns the depth d of a point, which is 0 without multipliers.
    fn depth(&self, index: usize) -> f64 {
        self.depths.get(index).copied().unwrap_or(0.0)
    }

    /// Calls `kernel` at each quadrature point in contact.
    fn for_each_touch<const D: usize>(
        &self,
        offset: &[f64],
        u: &[f64],
        mut kernel: impl FnMut(&Touch<'_, D>),
    ) {
        let mut index = 0..;
        for (facet, nodes) in self.boundary.facets.iter().enumerate() {
            let points = self.boundary.points.iter().zip(&self.weights[facet]);
            for ((point, &weight), index) in points.zip(&mut index) {
                let gap =
                    self.obstacle.gap::<D>(self.boundary.sum(nodes, &point.values, u), offset);
                let depth = self.depth(index) - gap.distance;
                if depth > 0.0 {
                    kernel(&Touch {
                        facet,
                        index,
                        depth,
                        values: &point.values[..nodes.len()],
                        weight,
                        potential: self.potential(depth),
                        gap,
                    });
                }
            }
        }
    }

    /// Adds `sign` times the force of the obstacle on the body to `total`. The obstacle is displaced by `offset`,
    /// and the body by `u`.
    pub fn add_force(&self, offset: &[f64], sign: f64, u: &[f64], total: &mut [f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            self.for_each_touch::<D>(offset, u, |touch| {
                for (&node, value) in self.boundary.facets[touch.facet].iter().zip(touch.values) {
                    let factor = sign * touch.potential[1] * touch.weight * value;
                    for (total, normal) in total[D * node..].iter_mut().zip(touch.gap.normal) {
                        *total += factor * normal;
                    }
                }
            });
        })
    }

    /// Adds the derivative of the force with respect to the free components of `u` to `values`. The derivative is
    /// ∫ (−φ'' n⊗n + φ' ∇∇g) φ_a φ_b dS.
    ///
    /// # Shapes
    /// `values` holds the entries of [`Solid::displacement_pattern`].
    pub fn add_stiffness(&self, offset: &[f64], u: &[f64], values: &mut [f64]) {
        in_dimension!(self.boundary.dimension, |D| {
            self.for_each_touch::<D>(offset, u, |touch| {
                self.add_block(touch, &touch.slope(), values);
            });
        })
    }

    /// Adds the contribution of one quadrature point to the integrals of a `block` times the shape functions of
    /// rows and columns.
    fn add_block<const D: usize>(
        &self,
        touch: &Touch<'_, D>,
        block: &[[f64; D]; D],
        values: &mut [f64],
    ) {
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
    }

    /// Returns the sums over the contact at displacement `u`.
    pub fn sums(&self, offset: &[f64], u: &[f64]) -> ContactSums {
        in_dimension!(self.boundary.dimension, |D| {
            let mut sums = ContactSums::default();
            // Points at which the contact has opened also have the energy −φ(d).
            let points = self.depths.iter().zip(self.weights.iter().flatten());
            points.for_each(|(&d, weight)| sums.energy -= weight * self.potential(d)[0]);
            self.for_each_touch::<D>(offset, u, |touch| {
                for (force, normal) in sums.force.iter_mut().zip(touch.gap.normal) {
                    *force += touch.weight * touch.potential[1] * normal;
                }
                sums.energy += touch.weight * touch.potential[0];
                sums.penetration = sums.penetration.max(-touch.gap.distance);
            });
            sums
        })
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

#[cfg(test)]
mod tests;

//! Stresses added to the laws in regions of elements: active stress along the fibers and viscous stress.
//!
//! ```text
//! P = τ(T, λ, λ̇) (F f0)⊗f0 + F η Ė
//! ```
//!
//! One pass over the regions with added stress evaluates the force or its tangents with respect to displacement
//! and velocity. The displacement tangent is not symmetric if the stress depends on the velocity. See
//! `material::ActiveStress` and `material::Viscous`.

use pulp::{Simd, WithSimd};

use crate::material::{ActiveFiber, ActiveStress, Real, Viscous};
use crate::operators::fields::slots;
use crate::operators::residual::accumulate;
use crate::operators::tangent::{Matrix, scatter, zero_if};
use crate::simd::batch::{Batch, BatchRange, Part, Point, add_scaled};
use crate::simd::lanes::{Lanes, outlined};
use crate::space::sparsity::ScatterMap;

/// Stress added to the law of a region.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AddedStress {
    /// Active stress along the fibers; the tension is given at each evaluation.
    pub active: Option<ActiveStress>,
    /// Viscosity η of Kelvin–Voigt damping, in Pa·s.
    pub viscosity: f64,
}

impl AddedStress {
    /// Returns whether the stress depends on the velocity. The displacement tangent is then not
    /// symmetric.
    pub fn is_viscous(&self) -> bool {
        self.viscosity > 0.0 || self.active.is_some_and(|active| active.force_velocity.is_some())
    }
}

/// Fields for which added stresses are evaluated.
///
/// # Shapes
/// `u` and `v` have length `n_components`. If there are added stresses, `tensions` has one entry (Pa) per element.
/// Entries of elements without active stress are ignored.
#[derive(Debug, Clone, Copy)]
pub struct AddedMotion<'a> {
    /// Displacement.
    pub u: &'a [f64],
    /// Velocity.
    pub v: &'a [f64],
    /// Active tensions T.
    pub tensions: &'a [f64],
}

/// Requested tangents of the force of added stresses. Each given buffer is overwritten with values in the order of
/// the displacement pattern.
#[derive(Debug, Default)]
pub struct AddedTangents<'a> {
    /// Derivative with respect to the displacement.
    pub by_displacement: Option<&'a mut [f64]>,
    /// Derivative with respect to the velocity. It is zero unless a stress [is viscous](AddedStress::is_viscous).
    pub by_velocity: Option<&'a mut [f64]>,
}

slots!(AddedTangents, 2, by_displacement, by_velocity);

/// Added stress at a point for the motion ∇u, ∇v.
pub(crate) struct AtPoint<R, const D: usize> {
    fiber: Option<ActiveFiber<R, D>>,
    viscous: Option<Viscous<R, D>>,
}

/// Nodal values of the motion for a part of a batch.
struct Local<S: Simd, const D: usize, const N: usize> {
    u: [[Lanes<S>; D]; N],
    v: [[Lanes<S>; D]; N],
    /// Tension. `None` if the tension is zero in all elements.
    tension: Option<Lanes<S>>,
}

impl<R: Real, const D: usize> AtPoint<R, D> {
    /// Creates the stress at a point with the given tension and the undeformed fiber direction `reference`. Only
    /// the active stress uses this direction.
    #[inline(always)]
    pub(crate) fn new(
        stress: &AddedStress,
        tension: Option<R>,
        reference: [R; D],
        [h, v]: [[[R; D]; D]; 2],
    ) -> Self {
        let fiber = match (&stress.active, tension) {
            (Some(active), Some(tension)) => Some(active.at(reference, &h, &v, tension)),
            _ => None,
        };
        let viscous = if stress.viscosity > 0.0 {
            let mut f = h;
            for (i, row) in f.iter_mut().enumerate() {
                row[i] = row[i] + row[i].like(1.0);
            }
            Some(Viscous::new(f, v, h[0][0].like(stress.viscosity)))
        } else {
            None
        };
        Self { fiber, viscous }
    }

    /// Returns P.
    // Closures are avoided, because they would be compiled without vector instructions.
    #[inline(always)]
    pub(crate) fn stress(&self, zero: R) -> [[R; D]; D] {
        let mut total = [[zero; D]; D];
        if let Some(fiber) = &self.fiber {
            add(&mut total, &fiber.stress());
        }
        if let Some(viscous) = &self.viscous {
            add(&mut total, &viscous.stress());
        }
        total
    }
}

#[inline(always)]
fn add<R: Real, const D: usize>(sum: &mut [[R; D]; D], tensor: &[[R; D]; D]) {
    for (sum, row) in sum.iter_mut().zip(tensor) {
        for (sum, entry) in sum.iter_mut().zip(row) {
            *sum = *sum + *entry;
        }
    }
}

/// Batches with their added stresses, and the motion.
#[derive(Clone, Copy)]
pub(crate) struct Regions<'a, const D: usize, const N: usize, const P: usize> {
    pub(crate) elements: BatchRange<'a, D, N, P>,
    pub(crate) stresses: &'a [AddedStress],
    pub(crate) motion: AddedMotion<'a>,
}

impl<const D: usize, const N: usize, const P: usize> Regions<'_, D, N, P> {
    /// Returns the index of each batch with a nonzero stress, the batch, and the index of the stress.
    fn members(&self) -> impl Iterator<Item = (usize, &Batch<D, N, P>, usize)> {
        let batches = self.elements.batches.iter().enumerate();
        let acts = |number: usize| self.stresses[number] != AddedStress::default();
        batches.filter_map(move |(index, batch)| {
            let number = batch.material.added.filter(|number| acts(*number))?;
            Some((index, batch, number))
        })
    }

    #[inline(always)]
    fn gather<S: Simd>(&self, number: usize, part: &Part<'_, S, D, N, P>) -> Local<S, D, N> {
        Local {
            u: part.gather_vector(Some(self.motion.u)),
            v: part.gather_vector(Some(self.motion.v)),
            tension: self.stresses[number]
                .active
                .and_then(|_| part.gather_element(self.motion.tensions)),
        }
    }

    /// Returns the stress with the index `number` at a quadrature point.
    #[inline(always)]
    fn at<S: Simd>(
        &self,
        number: usize,
        part: &Part<'_, S, D, N, P>,
        (index, point): (usize, &Point<D, N, P>),
        local: &Local<S, D, N>,
    ) -> AtPoint<Lanes<S>, D> {
        let stress = &self.stresses[number];
        let fiber = match stress.active {
            Some(_) => part.fiber(index),
            None => [part.zero(); D],
        };
        let motion = [part.gradient(&local.u, point), part.gradient(&local.v, point)];
        AtPoint::new(stress, local.tension, fiber, motion)
    }
}

/// Pass for the force of all added stresses.
pub(crate) struct Force<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) regions: Regions<'a, D, N, P>,
    pub(crate) out: &'b mut [f64],
}

impl<const D: usize, const N: usize, const P: usize> WithSimd for Force<'_, '_, D, N, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { regions, out } = self;
        out.fill(0.0);
        for (_, batch, number) in regions.members() {
            for part in 0..batch.n_parts(simd) {
                let part = &mut batch.part(simd, part).element_wise(regions.elements.element_wise);
                let local = regions.gather(number, part);
                let mut force = [[part.zero(); D]; N];
                for (index, point) in regions.elements.points.iter().enumerate() {
                    part.move_to(index);
                    let at = regions.at(number, part, (index, point), &local);
                    accumulate(&mut force, part, point, &at.stress(part.zero()));
                }
                part.scatter_vector(&force, out);
            }
        }
    }
}

/// Pass for the tangents of the force.
pub(crate) struct ForceTangents<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) regions: Regions<'a, D, N, P>,
    pub(crate) maps: &'a [ScatterMap<D, N, P>],
    pub(crate) out: AddedTangents<'b>,
}

impl<const D: usize, const N: usize, const P: usize> WithSimd for ForceTangents<'_, '_, D, N, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { regions, maps, mut out } = self;
        let requested = [&mut out.by_displacement, &mut out.by_velocity];
        for values in requested.into_iter().flatten() {
            values.fill(0.0);
        }
        for (batch_index, batch, number) in regions.members() {
            for part in 0..batch.n_parts(simd) {
                let part = &mut batch.part(simd, part);
                let local = regions.gather(number, part);
                let zero = [[[[part.zero(); D]; D]; N]; N];
                let mut by_u = zero_if(out.by_displacement.is_some(), zero);
                let by_rate = out.by_velocity.is_some() && regions.stresses[number].is_viscous();
                let mut by_v = zero_if(by_rate, zero);
                for (index, point) in regions.elements.points.iter().enumerate() {
                    part.move_to(index);
                    let at = regions.at(number, part, (index, point), &local);
                    let add =
                        Add { at: &at, part, point, by_u: by_u.as_mut(), by_v: by_v.as_mut() };
                    outlined(simd, add);
                }
                for (local, global) in
                    [(&by_u, &mut out.by_displacement), (&by_v, &mut out.by_velocity)]
                {
                    if let (Some(local), Some(global)) = (local, global) {
                        scatter::<S, D, N, P, false>(part, &maps[batch_index], local, global);
                    }
                }
            }
        }
    }
}

/// Adds ∇φ_a·∂P·∇φ_b of one point to the element matrices.
struct Add<'a, S: Simd, const D: usize, const N: usize, const P: usize> {
    at: &'a AtPoint<Lanes<S>, D>,
    part: &'a Part<'a, S, D, N, P>,
    point: &'a Point<D, N, P>,
    by_u: Option<&'a mut Matrix<S, D, N>>,
    by_v: Option<&'a mut Matrix<S, D, N>>,
}

impl<T: Simd, const D: usize, const N: usize, const P: usize> WithSimd for Add<'_, T, D, N, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { at, part, point, mut by_u, mut by_v } = self;
        let gradients = part.gradients(point);
        let weights = part.weights(point);
        if let Some(fiber) = &at.fiber {
            // The derivatives are dyads of the fiber direction in the indices J and L.
            let mut fiber_slopes = [part.zero(); N];
            for (slope, gradient) in fiber_slopes.iter_mut().zip(&gradients) {
                for (f, g) in fiber.direction().iter().zip(gradient) {
                    *slope = f.mul_add(*g, *slope);
                }
            }
            let tangents = [(&mut by_u, fiber.by_displacement()), (&mut by_v, fiber.by_velocity())];
            for (matrix, tangent) in tangents {
                if let Some(matrix) = matrix {
                    for (row, slope_a) in matrix.iter_mut().zip(&fiber_slopes) {
                        for (entries, slope_b) in row.iter_mut().zip(&fiber_slopes) {
                            add_scaled(entries, weights * *slope_a * *slope_b, &tangent);
                        }
                    }
                }
            }
        }
        if let Some(viscous) = &at.viscous {
            let tangents = viscous.tangents();
            let mut products = [tangents.products(gradients[0]); N];
            for (products, gradient) in products.iter_mut().zip(&gradients) {
                *products = tangents.products(*gradient);
            }
            if let Some(matrix) = &mut by_u {
                for (row, a) in matrix.iter_mut().zip(&products) {
                    for (entries, b) in row.iter_mut().zip(&products) {
                        add_scaled(entries, weights, &tangents.by_displacement(a, b));
                    }
                }
            }
            if let Some(matrix) = &mut by_v {
                for (row, a) in matrix.iter_mut().zip(&products) {
                    for (entries, b) in row.iter_mut().zip(&products) {
                        add_scaled(entries, weights, &tangents.by_velocity(a, b));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{AddedStress, AtPoint};

    #[test]
    fn viscous_stress_of_a_stretch_is_eta_times_its_rate() {
        let stress = AddedStress { viscosity: 40.0, ..AddedStress::default() };
        let (stretch, rate) = (1.25, 0.5);
        let motion = [[[stretch - 1.0, 0.0], [0.0; 2]], [[rate, 0.0], [0.0; 2]]];
        let point = AtPoint::new(&stress, None, [1.0, 0.0], motion);
        // P_11 = η λ² λ̇. These numbers are exact in binary arithmetic.
        assert_eq!(point.stress(0.0)[0][0], 40.0 * stretch * stretch * rate);
    }
}

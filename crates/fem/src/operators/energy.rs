//! Element pass for the strain energy.

use pulp::{Simd, WithSimd};

use crate::material::Real;
use crate::operators::constitutive::{Constitutive, Spatial, in_space};
use crate::operators::fields::{Fields, Pressure};
use crate::simd::batch::{Batches, Part, Point};
use crate::simd::lanes::Lanes;

/// Pass over all batches. In 2D, it evaluates the 3D energy at F33 = 1.
pub(crate) struct StrainEnergy<'a, const D: usize, const N: usize, const P: usize> {
    pub(crate) elements: &'a Batches<D, N, P>,
    pub(crate) fields: &'a Fields<'a>,
}

impl<const D: usize, const N: usize, const P: usize> WithSimd for StrainEnergy<'_, D, N, P> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Batches { points, batches } = self.elements;
        let mut sum = 0.0;
        for batch in batches {
            for part in 0..batch.n_parts(simd) {
                let part = &mut batch.part(simd, part);
                let energies = element_energies(part, points, self.fields);
                // The sum is computed element by element, so that it does not depend on the width of the
                // registers.
                for energy in &energies.as_slice()[..part.occupied().len()] {
                    sum += energy;
                }
            }
        }
        sum
    }
}

/// Returns ∫ W(F) − p g(J) or ∫ W(F) + κ/2 g(J)² for each element of a part.
#[inline(always)]
fn element_energies<S: Simd, const D: usize, const N: usize, const P: usize>(
    part: &mut Part<'_, S, D, N, P>,
    points: &[Point<D, N, P>],
    fields: &Fields<'_>,
) -> Lanes<S> {
    let law = part.law();
    let spatial = Spatial::of(&part.batch.material);
    let u = part.gather_vector(Some(fields.u));
    let (p, kappa) = match fields.pressure {
        Pressure::Nodal(p) => (Some(p), 0.0),
        Pressure::Penalty { kappa } => (None, law.penalty(kappa * part.scale().kappa)),
    };
    let p = part.gather_scalar(p);
    let factors = part.gather_factors(fields.factors);
    let mut sum = part.zero();
    for (number, point) in points.iter().enumerate() {
        part.move_to(number);
        let factor = part.interpolate_factors(&factors, point);
        let axes = part.axes(number, law.has_fibers());
        let h = in_space(&part.gradient(&u, point), part.zero());
        let strain = spatial.strain(h, axes, factor);
        let g = strain.volume();
        let volume = g * (0.5 * kappa) - part.interpolate(&p, point);
        let density = g.mul_add(volume, spatial.energy(&strain));
        sum = part.weights(point).mul_add(density, sum);
    }
    sum
}

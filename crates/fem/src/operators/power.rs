//! Element pass for the power of each element.

use pulp::{Simd, WithSimd};

use crate::material::Real;
use crate::material::tensor::Volumetric;
use crate::operators::constitutive::{Constitutive, Spatial, in_space};
use crate::operators::fields::{Fields, Inverted};
use crate::simd::batch::{Batches, Part, Point};
use crate::simd::lanes::Lanes;

/// Pass over all batches. In 2D, the 3D law is evaluated at F33 = 1, as in the pass for the energy.
pub(crate) struct Powers<'a, const D: usize, const N: usize, const P: usize> {
    pub(crate) elements: &'a Batches<D, N, P>,
    pub(crate) fields: &'a Fields<'a>,
    /// Coefficient β in P + β Ṗ.
    pub(crate) beta: f64,
    pub(crate) direction: &'a [f64],
    pub(crate) out: &'a mut [f64],
}

impl<const D: usize, const N: usize, const P: usize> WithSimd for Powers<'_, D, N, P> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Batches { points, batches } = self.elements;
        for batch in batches {
            for part in 0..batch.n_parts(simd) {
                let part = &mut batch.part(simd, part);
                let powers =
                    element_powers(part, points, (self.fields, self.beta), self.direction)?;
                let occupied = part.occupied().len();
                for (lane, power) in powers.as_slice()[..occupied].iter().enumerate() {
                    self.out[part.element(lane)] += power;
                }
            }
        }
        Ok(())
    }
}

/// Returns ∫ (P + β Ṗ) : ∇w for each element of a part. Here, P excludes the volume terms.
#[inline(always)]
fn element_powers<S: Simd, const D: usize, const N: usize, const P: usize>(
    part: &mut Part<'_, S, D, N, P>,
    points: &[Point<D, N, P>],
    (fields, beta): (&Fields<'_>, f64),
    direction: &[f64],
) -> Result<Lanes<S>, Inverted> {
    let law = Spatial::new(part.law());
    let beta = beta * part.scale().beta;
    let u = part.gather_vector(Some(fields.u));
    let v = part.gather_vector(fields.v.filter(|_| beta > 0.0));
    let w = part.gather_vector(Some(direction));
    let factors = part.gather_factors(fields.factors);
    let zero = part.zero();
    let no_volume = Volumetric { p: zero, p_rate: zero, kappa: 0.0 };
    let mut sum = zero;
    for (number, point) in points.iter().enumerate() {
        part.move_to(number);
        let axes = part.axes(number, law.has_fibers());
        let h = in_space(&part.gradient(&u, point), zero);
        let factor = part.interpolate_factors(&factors, point);
        let strain = law.strain(h, axes, factor);
        if law.is_finite() {
            part.expect_not_inverted(point, law.dilation(&strain))?;
        }
        let mut stress = law.stress(&strain, no_volume, None);
        if beta > 0.0 {
            let h_rate = in_space(&part.gradient(&v, point), zero);
            let rates = law.stress(&strain, no_volume, Some(&h_rate));
            for (row, rates) in stress.iter_mut().zip(rates) {
                for (entry, rate) in row.iter_mut().zip(rates) {
                    *entry = rate.mul_add(zero.like(beta), *entry);
                }
            }
        }
        let mut density = zero;
        for (row, direction) in stress.iter().zip(part.gradient(&w, point)) {
            for (entry, direction) in row.iter().zip(direction) {
                density = entry.mul_add(direction, density);
            }
        }
        sum = part.weights(point).mul_add(density, sum);
    }
    Ok(sum)
}

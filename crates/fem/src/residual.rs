//! One pass over the elements for all vectors: force, its rate, defect, its rate, Bᵀμ.

use pulp::{Simd, WithSimd};

use crate::batch::{Batches, Part, Point};
use crate::fields::{Fields, Inverted, Pressure, Vectors};
use crate::lanes::Lanes;
use crate::material::tensor::{Strain, TensorOf, Volumetric, scaled};
use crate::material::{Potential, Real, with_potential};

/// Nodal values of the fields in one part of a batch.
///
/// `RATES`: whether v, ṗ and μ are wanted, known to the compiler so that a pass without them does
/// not pay for them (a tenth of it, if asked at each point). Without, they are zero.
pub(crate) struct Local<S: Simd, const N: usize, const RATES: bool> {
    u: [[Lanes<S>; 2]; N],
    v: [[Lanes<S>; 2]; N],
    p: [Lanes<S>; 3],
    p_rate: [Lanes<S>; 3],
    mu: [Lanes<S>; 3],
    factors: Option<[Lanes<S>; 3]>,
    kappa: f64,
}

impl<S: Simd, const N: usize, const RATES: bool> Local<S, N, RATES> {
    /// Fields that are not given count as zero; the callers have checked those that must be there.
    #[inline(always)]
    pub(crate) fn gather(part: &Part<'_, S, N>, fields: &Fields<'_>) -> Self {
        let (p, kappa) = match fields.pressure {
            Pressure::Nodal(p) => (Some(p), 0.0),
            Pressure::Penalty { kappa } => (None, kappa),
        };
        Self {
            u: part.gather_vector(Some(fields.u)),
            v: part.gather_vector(fields.v.filter(|_| RATES)),
            p: part.gather_scalar(p),
            p_rate: part.gather_scalar(fields.p_rate.filter(|_| RATES)),
            mu: part.gather_scalar(fields.mu.filter(|_| RATES)),
            factors: fields.factors.map(|factors| part.gather_factors(factors)),
            kappa,
        }
    }
}

/// Fields at one quadrature point of one part of a batch.
pub(crate) struct AtPoint<S: Simd> {
    pub(crate) strain: Strain<Lanes<S>>,
    pub(crate) v: TensorOf<Lanes<S>>,
    pub(crate) volumetric: Volumetric<Lanes<S>>,
    pub(crate) mu: Lanes<S>,
}

impl<S: Simd> AtPoint<S> {
    /// Interpolates to a point and checks that no element is inverted there.
    #[inline(always)]
    pub(crate) fn new<const N: usize, const RATES: bool, W: Potential>(
        w: &W,
        part: &Part<'_, S, N>,
        point: &Point<N>,
        local: &Local<S, N, RATES>,
    ) -> Result<Self, Inverted> {
        let mut strain = Strain::new(w, part.gradient(&local.u, point));
        if let Some(factors) = &local.factors {
            strain.factor = Some(part.interpolate(factors, point));
        }
        if W::FINITE {
            let inverted = |d: &f64| *d <= -1.0 || d.is_nan();
            if let Some(lane) = strain.d.as_slice().iter().position(inverted) {
                let jacobian = 1.0 + strain.d.as_slice()[lane];
                return Err(Inverted::new(part.element(lane), point.psi, jacobian));
            }
        }
        let zero = part.zero();
        let v = if RATES {
            part.gradient(&local.v, point)
        } else {
            [[zero; 2]; 2]
        };
        let p_rate = if RATES {
            part.interpolate(&local.p_rate, point)
        } else {
            zero
        };
        let mu = if RATES {
            part.interpolate(&local.mu, point)
        } else {
            zero
        };
        Ok(Self {
            strain,
            v,
            volumetric: Volumetric {
                p: part.interpolate(&local.p, point),
                p_rate,
                kappa: local.kappa,
            },
            mu,
        })
    }
}

/// Adds ∫ flux : ∇φ of one point to the element vectors.
#[inline(always)]
fn accumulate<S: Simd, const N: usize>(
    out: &mut [[Lanes<S>; 2]; N],
    part: &Part<'_, S, N>,
    point: &Point<N>,
    flux: &TensorOf<Lanes<S>>,
) {
    let flux = part.pull_back(point, flux);
    for (node, gradient) in out.iter_mut().zip(&point.gradients) {
        for (sum, row) in node.iter_mut().zip(&flux) {
            let [xi, eta] = [sum.like(gradient[0]), sum.like(gradient[1])];
            *sum = row[0].mul_add(xi, row[1].mul_add(eta, *sum));
        }
    }
}

/// Adds ∫ ψ f of one point to the element vectors.
#[inline(always)]
fn accumulate_scalar<S: Simd, const N: usize>(
    out: &mut [Lanes<S>; 3],
    part: &Part<'_, S, N>,
    point: &Point<N>,
    f: Lanes<S>,
) {
    let weighted = part.weights(point) * f;
    for (sum, psi) in out.iter_mut().zip(point.psi) {
        *sum = weighted.mul_add(sum.like(psi), *sum);
    }
}

#[inline(always)]
fn evaluate_part<S: Simd, const N: usize, const RATES: bool, W: Potential>(
    w: &W,
    part: &Part<'_, S, N>,
    points: &[Point<N>],
    fields: &Fields<'_>,
    out: &mut Vectors<'_>,
) -> Result<(), Inverted> {
    let local = Local::<S, N, RATES>::gather(part, fields);
    let zero = [[part.zero(); 2]; N];
    let (mut force, mut force_rate, mut multiplier_force) = (zero, zero, zero);
    let (mut defect, mut defect_rate) = ([part.zero(); 3], [part.zero(); 3]);
    for point in points {
        let at = AtPoint::new(w, part, point, &local)?;
        if out.force.is_some() {
            let flux = at.strain.stress(w, at.volumetric);
            accumulate(&mut force, part, point, &flux);
        }
        if RATES && out.force_rate.is_some() {
            let flux = at.strain.stress_rate(w, at.v, at.volumetric);
            accumulate(&mut force_rate, part, point, &flux);
        }
        if RATES && out.multiplier_force.is_some() {
            let flux = scaled(at.mu, at.strain.normal);
            accumulate(&mut multiplier_force, part, point, &flux);
        }
        if out.defect.is_some() {
            accumulate_scalar(&mut defect, part, point, at.strain.d);
        }
        if RATES && out.defect_rate.is_some() {
            let rate = at.strain.dilation_rate(at.v);
            accumulate_scalar(&mut defect_rate, part, point, rate);
        }
    }
    if let Some(global) = &mut out.force {
        part.scatter_vector(&force, global);
    }
    if let Some(global) = &mut out.defect {
        part.scatter_scalar(&defect, global);
    }
    if RATES {
        for (local, global) in [
            (&force_rate, &mut out.force_rate),
            (&multiplier_force, &mut out.multiplier_force),
        ] {
            if let Some(global) = global {
                part.scatter_vector(local, global);
            }
        }
        if let Some(global) = &mut out.defect_rate {
            part.scatter_scalar(&defect_rate, global);
        }
    }
    Ok(())
}

/// The pass over all batches, to be run with the processor's vector instructions.
pub(crate) struct Evaluate<'a, 'b, const N: usize> {
    pub(crate) elements: &'a Batches<N>,
    pub(crate) fields: &'a Fields<'a>,
    pub(crate) out: &'a mut Vectors<'b>,
}

impl<const N: usize> WithSimd for Evaluate<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        if self.out.has_rates() {
            self.pass::<S, true>(simd)
        } else {
            self.pass::<S, false>(simd)
        }
    }
}

impl<const N: usize> Evaluate<'_, '_, N> {
    #[inline(always)]
    fn pass<S: Simd, const RATES: bool>(self, simd: S) -> Result<(), Inverted> {
        let Self {
            elements,
            fields,
            out,
        } = self;
        for vector in out.all_mut() {
            vector.fill(0.0);
        }
        for batch in &elements.batches {
            with_potential!(batch.law, w => {
                for part in 0..batch.n_parts(simd) {
                    let part = batch.part(simd, part);
                    evaluate_part::<_, _, RATES, _>(&w, &part, &elements.points, fields, out)?;
                }
            });
        }
        Ok(())
    }
}

//! Element pass for all vectors: force, volume residual, the rates of both, and Bᵀμ.

use pulp::Simd;

use crate::material::Real;
use crate::material::tensor::Volumetric;
use crate::operators::constitutive::{Constitutive, Tensor};
use crate::operators::fields::{Fields, Inverted, Pressure, Vectors};
use crate::operators::pass::Kernel;
use crate::simd::batch::{Part, Point, add_dot};
use crate::simd::lanes::Lanes;

/// Nodal values of the fields for a part of a batch.
///
/// `RATES` states at compile time whether v, ṗ and μ are needed. If they are not needed, they are zero. A test at
/// each point would take a tenth of the time of a pass without rates.
pub(crate) struct Local<S: Simd, const D: usize, const N: usize, const P: usize, const RATES: bool>
{
    u: [[Lanes<S>; D]; N],
    v: [[Lanes<S>; D]; N],
    p: [Lanes<S>; P],
    p_rate: [Lanes<S>; P],
    mu: [Lanes<S>; P],
    factors: Option<[Lanes<S>; P]>,
    kappa: f64,
    /// Whether v, ṗ and μ are needed. If `RATES` is true, this flag is tested at run time.
    moving: bool,
}

impl<S: Simd, const D: usize, const N: usize, const P: usize, const RATES: bool>
    Local<S, D, N, P, RATES>
{
    /// Gathers the fields. Missing fields count as zero, and callers check that required fields exist.
    #[inline(always)]
    pub(crate) fn gather(part: &Part<'_, S, D, N, P>, fields: &Fields<'_>, moving: bool) -> Self {
        let (p, kappa) = match fields.pressure {
            Pressure::Nodal(p) => (Some(p), 0.0),
            Pressure::Penalty { kappa } => (None, kappa * part.scale().kappa),
        };
        Self {
            u: part.gather_vector(Some(fields.u)),
            v: part.gather_vector(fields.v.filter(|_| RATES && moving)),
            p: part.gather_scalar(p),
            p_rate: part.gather_scalar(fields.p_rate.filter(|_| RATES && moving)),
            mu: part.gather_scalar(fields.mu.filter(|_| RATES && moving)),
            factors: part.gather_factors(fields.factors),
            kappa,
            moving,
        }
    }
}

/// Fields at a quadrature point of a part.
pub(crate) struct AtPoint<S: Simd, const D: usize, C: Constitutive<D>> {
    pub(crate) strain: C::Strain<S>,
    pub(crate) v: Tensor<Lanes<S>, D>,
    pub(crate) volumetric: Volumetric<Lanes<S>>,
    pub(crate) mu: Lanes<S>,
}

impl<S: Simd, const D: usize, C: Constitutive<D>> AtPoint<S, D, C> {
    /// Interpolates the fields to a point. Returns an error if an element is inverted at this point.
    #[inline(always)]
    pub(crate) fn new<const N: usize, const P: usize, const RATES: bool>(
        law: &C,
        part: &Part<'_, S, D, N, P>,
        (number, point): (usize, &Point<D, N, P>),
        local: &Local<S, D, N, P, RATES>,
    ) -> Result<Self, Inverted> {
        let factor = part.interpolate_factors(&local.factors, point);
        let axes = part.axes(number, law.has_fibers());
        let strain = law.strain(part.gradient(&local.u, point), axes, factor);
        if law.is_finite() {
            part.expect_not_inverted(point, law.dilation(&strain))?;
        }
        let zero = part.zero();
        let v = if RATES && local.moving { part.gradient(&local.v, point) } else { [[zero; D]; D] };
        let p_rate =
            if RATES && local.moving { part.interpolate(&local.p_rate, point) } else { zero };
        let mu = if RATES && local.moving { part.interpolate(&local.mu, point) } else { zero };
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

/// Adds flux : ∇φ at one point to the element vectors.
#[inline(always)]
pub(crate) fn accumulate<S: Simd, const D: usize, const N: usize, const P: usize>(
    out: &mut [[Lanes<S>; D]; N],
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    flux: &Tensor<Lanes<S>, D>,
) {
    let flux = part.pull_back(point, flux);
    for (node, gradient) in out.iter_mut().zip(&point.gradients) {
        for (sum, row) in node.iter_mut().zip(&flux) {
            *sum = add_dot(row, gradient, *sum);
        }
    }
}

/// Adds ψ f at one point to the element vectors.
#[inline(always)]
fn accumulate_scalar<S: Simd, const D: usize, const N: usize, const P: usize>(
    out: &mut [Lanes<S>; P],
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    f: Lanes<S>,
) {
    let weighted = part.weights(point) * f;
    for (sum, psi) in out.iter_mut().zip(point.psi) {
        *sum = weighted.mul_add(sum.like(psi), *sum);
    }
}

/// Returns m N.
#[inline(always)]
fn scaled<S: Simd, const D: usize>(
    m: Lanes<S>,
    mut cofactor: Tensor<Lanes<S>, D>,
) -> Tensor<Lanes<S>, D> {
    for row in &mut cofactor {
        for entry in row {
            *entry = m * *entry;
        }
    }
    cofactor
}

/// Kernel for the requested vectors.
pub(crate) struct Evaluate<'a, 'b> {
    pub(crate) fields: &'a Fields<'a>,
    pub(crate) out: Vectors<'b>,
}

impl<const D: usize, const N: usize, const P: usize> Kernel<D, N, P> for Evaluate<'_, '_> {
    const SPLIT: bool = true;

    type Workspace<S: Simd> = ();

    fn clear(&mut self) {
        self.out.all_mut().for_each(|vector| vector.fill(0.0));
    }

    fn has_rates(&self) -> bool {
        self.out.has_rates()
    }

    #[inline(always)]
    fn part<S: Simd, C: Constitutive<D>, const RATES: bool>(
        &mut self,
        law: &C,
        part: &mut Part<'_, S, D, N, P>,
        points: &[Point<D, N, P>],
        _: usize,
        (): &mut (),
    ) -> Result<(), Inverted> {
        let Self { fields, out } = self;
        let local = Local::<S, D, N, P, RATES>::gather(part, fields, out.has_rates());
        let zero = [[part.zero(); D]; N];
        let (mut force, mut force_rate, mut multiplier_force) = (zero, zero, zero);
        let (mut volume_residual, mut volume_residual_rate) = ([part.zero(); P], [part.zero(); P]);
        for (number, point) in points.iter().enumerate() {
            part.move_to(number);
            let at = AtPoint::new(law, part, (number, point), &local)?;
            if out.force.is_some() {
                let flux = law.stress(&at.strain, at.volumetric, None);
                accumulate(&mut force, part, point, &flux);
            }
            if RATES && out.force_rate.is_some() {
                let flux = law.stress(&at.strain, at.volumetric, Some(&at.v));
                accumulate(&mut force_rate, part, point, &flux);
            }
            if RATES && out.multiplier_force.is_some() {
                let flux = scaled(at.mu, law.volume_gradient(&at.strain, None));
                accumulate(&mut multiplier_force, part, point, &flux);
            }
            if out.volume_residual.is_some() {
                accumulate_scalar(&mut volume_residual, part, point, law.volume(&at.strain));
            }
            if RATES && out.volume_residual_rate.is_some() {
                let rate = law.volume_rate(&at.strain, at.v);
                accumulate_scalar(&mut volume_residual_rate, part, point, rate);
            }
        }
        if let Some(global) = &mut out.force {
            part.scatter_vector(&force, global);
        }
        if let Some(global) = &mut out.volume_residual {
            part.scatter_scalar(&volume_residual, global);
        }
        if RATES {
            let beta = part.scale().beta;
            if beta != 1.0 {
                for entry in force_rate.iter_mut().flatten() {
                    *entry = *entry * beta;
                }
            }
            for (local, global) in
                [(&force_rate, &mut out.force_rate), (&multiplier_force, &mut out.multiplier_force)]
            {
                if let Some(global) = global {
                    part.scatter_vector(local, global);
                }
            }
            if let Some(global) = &mut out.volume_residual_rate {
                part.scatter_scalar(&volume_residual_rate, global);
            }
        }
        Ok(())
    }
}

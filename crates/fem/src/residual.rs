//! One pass over the elements for all vectors: force, its rate, defect, its rate, Bᵀμ.

use pulp::{Simd, WithSimd};

use crate::batch::{Batch, Batches, Lanes, Point, TensorLanes, lane, lanes, tensor_lanes};
use crate::material::tensor::{
    Volumetric, contract, dilation, scaled, stress, stress_rate, volume_gradient,
};
use crate::material::{Potential, with_potential};
use crate::solid::{Fields, Inverted, Pressure, Vectors};

/// Nodal values of the fields in one batch.
pub(crate) struct Local<const N: usize> {
    pub(crate) u: [[Lanes; 2]; N],
    pub(crate) v: [[Lanes; 2]; N],
    pub(crate) p: [Lanes; 3],
    pub(crate) p_rate: [Lanes; 3],
    pub(crate) mu: [Lanes; 3],
    pub(crate) kappa: f64,
}

impl<const N: usize> Local<N> {
    /// Fields that are not given count as zero; the callers have checked those that must be there.
    #[inline(always)]
    pub(crate) fn gather(batch: &Batch<N>, fields: &Fields<'_>) -> Self {
        let (p, kappa) = match fields.pressure {
            Pressure::Nodal(p) => (Some(p), 0.0),
            Pressure::Penalty { kappa } => (None, kappa),
        };
        Self {
            u: batch.gather_vector(Some(fields.u)),
            v: batch.gather_vector(fields.v),
            p: batch.gather_scalar(p),
            p_rate: batch.gather_scalar(fields.p_rate),
            mu: batch.gather_scalar(fields.mu),
            kappa,
        }
    }
}

/// Fields at one quadrature point of one batch.
pub(crate) struct AtPoint {
    pub(crate) h: TensorLanes,
    pub(crate) v: TensorLanes,
    pub(crate) p: Lanes,
    pub(crate) p_rate: Lanes,
    pub(crate) mu: Lanes,
    pub(crate) kappa: f64,
}

impl AtPoint {
    /// Interpolates to a point and checks that no element is inverted there.
    #[inline(always)]
    pub(crate) fn new<const N: usize, W: Potential>(
        w: &W,
        batch: &Batch<N>,
        point: &Point<N>,
        local: &Local<N>,
        with_v: bool,
    ) -> Result<Self, (usize, f64)> {
        let h = batch.gradient(&local.u, point);
        if W::FINITE {
            let d = lanes!(l => dilation(w, lane(&h, l)));
            if let Some(l) = d.0.iter().position(|&d| d <= -1.0 || d.is_nan()) {
                return Err((l, 1.0 + d.0[l]));
            }
        }
        let v = if with_v {
            batch.gradient(&local.v, point)
        } else {
            [[Lanes::ZERO; 2]; 2]
        };
        Ok(Self {
            h,
            v,
            p: batch.interpolate(&local.p, point),
            p_rate: batch.interpolate(&local.p_rate, point),
            mu: batch.interpolate(&local.mu, point),
            kappa: local.kappa,
        })
    }

    #[inline(always)]
    pub(crate) fn volumetric(&self, l: usize) -> Volumetric {
        Volumetric {
            p: self.p.0[l],
            p_rate: self.p_rate.0[l],
            kappa: self.kappa,
        }
    }
}

/// Adds ∫ flux : ∇φ of one point to the element vectors.
#[inline(always)]
fn accumulate<const N: usize>(
    out: &mut [[Lanes; 2]; N],
    batch: &Batch<N>,
    point: &Point<N>,
    flux: &TensorLanes,
) {
    let flux = batch.pull_back(point, flux);
    for (node, gradient) in out.iter_mut().zip(&point.gradients) {
        for (sum, row) in node.iter_mut().zip(&flux) {
            *sum += row[0] * gradient[0] + row[1] * gradient[1];
        }
    }
}

/// Adds ∫ ψ f of one point to the element vectors.
#[inline(always)]
fn accumulate_scalar<const N: usize>(
    out: &mut [Lanes; 3],
    batch: &Batch<N>,
    point: &Point<N>,
    f: &Lanes,
) {
    let weighted = batch.weights(point) * *f;
    for (sum, psi) in out.iter_mut().zip(point.psi) {
        *sum += weighted * psi;
    }
}

#[inline(always)]
fn evaluate_batch<const N: usize, W: Potential>(
    w: &W,
    batch: &Batch<N>,
    points: &[Point<N>],
    fields: &Fields<'_>,
    out: &mut Vectors<'_>,
) -> Result<(), Inverted> {
    let local = Local::gather(batch, fields);
    let zero = [[Lanes::ZERO; 2]; N];
    let (mut force, mut force_rate, mut multiplier_force) = (zero, zero, zero);
    let (mut defect, mut defect_rate) = ([Lanes::ZERO; 3], [Lanes::ZERO; 3]);
    let rates = out.force_rate.is_some() || out.defect_rate.is_some();
    for point in points {
        let at = AtPoint::new(w, batch, point, &local, rates)
            .map_err(|(l, jacobian)| Inverted::new(batch.elements[l], point.psi, jacobian))?;
        let (h, v) = (&at.h, &at.v);
        if out.force.is_some() {
            let flux = tensor_lanes!(l => stress(w, lane(h, l), at.volumetric(l)));
            accumulate(&mut force, batch, point, &flux);
        }
        if out.force_rate.is_some() {
            let flux = tensor_lanes!(l => stress_rate(w, lane(h, l), lane(v, l), at.volumetric(l)));
            accumulate(&mut force_rate, batch, point, &flux);
        }
        if out.multiplier_force.is_some() {
            let flux = tensor_lanes!(l => scaled(at.mu.0[l], volume_gradient(w, lane(h, l))));
            accumulate(&mut multiplier_force, batch, point, &flux);
        }
        if out.defect.is_some() {
            accumulate_scalar(
                &mut defect,
                batch,
                point,
                &lanes!(l => dilation(w, lane(h, l))),
            );
        }
        if out.defect_rate.is_some() {
            let rate = lanes!(l => contract(volume_gradient(w, lane(h, l)), lane(v, l)));
            accumulate_scalar(&mut defect_rate, batch, point, &rate);
        }
    }
    for (local, global) in [
        (&force, &mut out.force),
        (&force_rate, &mut out.force_rate),
        (&multiplier_force, &mut out.multiplier_force),
    ] {
        if let Some(global) = global {
            batch.scatter_vector(local, global);
        }
    }
    for (local, global) in [
        (&defect, &mut out.defect),
        (&defect_rate, &mut out.defect_rate),
    ] {
        if let Some(global) = global {
            batch.scatter_scalar(local, global);
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
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
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
                evaluate_batch(&w, batch, &elements.points, fields, out)
            })?;
        }
        Ok(())
    }
}

//! Viscoelastic stress by Prony series with internal stresses at the quadrature points.
//!
//! With the second Piola–Kirchhoff stress S of the law (without the pressure term) and H = Σ g S −
//! Σ Q, the stress
//!
//! ```text
//! P = F H,        Q̇_k = (g_k S − Q_k)/τ_k
//! ```
//!
//! is added in regions with a Prony series. [`Prony`](crate::material::Prony) describes its
//! treatment in Newton's method. In 2D the out-of-plane component is stored too: no force depends
//! on it, but stress output does. Bodies without Prony series skip this pass.

mod layout;
mod point;

use pulp::Simd;

use crate::material::tensor::Volumetric;
use crate::material::{Law, Real};
use crate::operators::constitutive::{Constitutive, Tangent, Tensor};
use crate::operators::fields::Inverted;
use crate::operators::pass::Kernel;
use crate::operators::residual::accumulate;
use crate::operators::tangent::{Matrix, add, scatter, zero_if};
use crate::simd::batch::{Part, Point};
use crate::simd::lanes::Lanes;
use crate::space::sparsity::ScatterMap;
pub(crate) use layout::InternalStresses;
pub use layout::RelaxationRegion;
use point::{At, Slots, UnitStrains, times_deformation};

/// Overstress H = Σ g S − Σ Q.
#[derive(Debug, Clone, Copy)]
pub enum Overstress<'a> {
    /// Given by all internal stresses Q.
    Internal(&'a [f64]),
    /// Given by the values of H at the slots.
    Given(&'a [f64]),
}

/// Requested results of a pass. Nodal vectors and matrices are added to, other buffers are
/// overwritten.
pub(crate) enum Requested<'a> {
    /// Force ∫ F H : ∇φ and rates Q̇.
    Vectors {
        internal: &'a [f64],
        force: Option<&'a mut [f64]>,
        rates: &'a mut [f64],
    },
    /// Stress S at the slots.
    Stresses { out: &'a mut [f64] },
    /// Forces ∫ F T : ∇φ of several tensors T given at the slots.
    ForceOf {
        tensors: &'a [Vec<f64>],
        forces: &'a mut [Vec<f64>],
    },
    /// Stress rates Ṡ at the slots along several nodal velocities.
    StressRates {
        v: &'a [Vec<f64>],
        out: &'a mut [Vec<f64>],
    },
    /// Tangents ∂/∂u of ∫ F H : ∇φ at constant H, and of ∫ F S : ∇φ at constant F for each region.
    Tangents {
        over: Overstress<'a>,
        geometric: &'a mut [f64],
        material: &'a mut [Vec<f64>],
    },
}

/// Kernel for the viscoelastic elements.
pub(crate) struct Relax<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) maps: &'a [ScatterMap<D, N, P>],
    pub(crate) layout: &'a InternalStresses,
    pub(crate) u: &'a [f64],
    pub(crate) requested: Requested<'b>,
}

impl<const D: usize, const N: usize, const P: usize> Kernel<D, N, P> for Relax<'_, '_, D, N, P> {
    /// Velocities or forces.
    type Workspace<S: Simd> = Vec<[[Lanes<S>; D]; N]>;

    #[inline(always)]
    fn part<S: Simd, C: Constitutive<D>, const RATES: bool>(
        &mut self,
        law: &C,
        part: &mut Part<'_, S, D, N, P>,
        points: &[Point<D, N, P>],
        batch: usize,
        columns: &mut Vec<[[Lanes<S>; D]; N]>,
    ) -> Result<(), Inverted> {
        let Some(region) = part.batch.material.prony else {
            return Ok(());
        };
        let series = &self.layout.parts[region];
        let count = part.batch.count;
        let u = part.gather_vector(Some(self.u));
        self.requested.gather(part, columns);
        let wants_matrices = matches!(self.requested, Requested::Tangents { .. });
        let zero: Matrix<S, D, N> = [[[[part.zero(); D]; D]; N]; N];
        let mut matrices = zero_if(wants_matrices, [zero; 2]);
        for (number, point) in points.iter().enumerate() {
            part.move_to(number);
            let first = number * count * Slots::<S, D, N, P>::COMPONENTS;
            let slots = Slots {
                part,
                first: self.layout.first[batch] + first,
                count,
            };
            match &mut self.requested {
                Requested::ForceOf { tensors, .. } => {
                    // These forces do not depend on the law.
                    let h = part.gradient(&u, point);
                    for (force, tensors) in columns.iter_mut().zip(*tensors) {
                        let flux = times_deformation(&h, &slots.load(tensors));
                        accumulate(force, part, point, &flux);
                    }
                }
                Requested::Vectors {
                    internal,
                    force,
                    rates,
                } => {
                    let at = At::<S, D, C>::new(law, part, (number, point), &u);
                    let over = relax(&at, part.law(), series, &slots, (internal, &mut **rates));
                    if force.is_some() {
                        let flux = times_deformation(&at.h, &over);
                        accumulate(&mut columns[0], part, point, &flux);
                    }
                }
                Requested::Stresses { out } => {
                    let at = At::<S, D, C>::new(law, part, (number, point), &u);
                    slots.store((&at.stress, at.stress_across(part.law())), out);
                }
                Requested::StressRates { out, .. } => {
                    let at = At::<S, D, C>::new(law, part, (number, point), &u);
                    store_rates(law, &at, point, &slots, (&columns[..], &mut **out));
                }
                Requested::Tangents { over, .. } => {
                    let Some([material, geometric]) = &mut matrices else {
                        continue;
                    };
                    let at = At::<S, D, C>::new(law, part, (number, point), &u);
                    let over = overstress(*over, &at.stress, series, &slots);
                    add(
                        material,
                        part,
                        point,
                        &material_tangent(law, &at, part.zero()),
                    );
                    add_geometric(geometric, part, point, &over);
                }
            }
        }
        let map = &self.maps[batch];
        self.requested
            .scatter((&*part, map, region), columns, &matrices);
        Ok(())
    }
}

impl Requested<'_> {
    /// Gathers the velocities, or allocates the forces, of a part of a batch.
    #[inline(always)]
    fn gather<S: Simd, const D: usize, const N: usize, const P: usize>(
        &self,
        part: &Part<'_, S, D, N, P>,
        columns: &mut Vec<[[Lanes<S>; D]; N]>,
    ) {
        columns.clear();
        let zero = [[part.zero(); D]; N];
        match self {
            Self::Vectors { .. } => columns.push(zero),
            Self::ForceOf { forces, .. } => columns.resize(forces.len(), zero),
            Self::StressRates { v, .. } => {
                for v in *v {
                    columns.push(part.gather_vector(Some(v)));
                }
            }
            Self::Stresses { .. } | Self::Tangents { .. } => {}
        }
    }

    /// Adds the forces or the matrices [material, geometric] of a part of a batch in a region.
    #[inline(always)]
    fn scatter<S: Simd, const D: usize, const N: usize, const P: usize>(
        &mut self,
        (part, map, region): (&Part<'_, S, D, N, P>, &ScatterMap<D, N, P>, usize),
        columns: &[[[Lanes<S>; D]; N]],
        matrices: &Option<[Matrix<S, D, N>; 2]>,
    ) {
        match self {
            Self::Vectors { force, .. } => {
                if let Some(force) = force {
                    part.scatter_vector(&columns[0], force);
                }
            }
            Self::ForceOf { forces, .. } => {
                for (local_force, force) in columns.iter().zip(forces.iter_mut()) {
                    part.scatter_vector(local_force, force);
                }
            }
            Self::Stresses { .. } | Self::StressRates { .. } => {}
            Self::Tangents {
                geometric,
                material,
                ..
            } => {
                if let Some([local_material, local_geometric]) = matrices {
                    scatter(part, map, local_material, &mut material[region]);
                    scatter(part, map, local_geometric, geometric);
                }
            }
        }
    }
}

/// Stores the rates of the internal stresses at a point and returns H.
#[inline(always)]
fn relax<S: Simd, const D: usize, const N: usize, const P: usize, C: Constitutive<D>>(
    at: &At<S, D, C>,
    law: Law,
    series: &RelaxationRegion,
    slots: &Slots<'_, '_, S, D, N, P>,
    (internal, rates): (&[f64], &mut [f64]),
) -> Tensor<Lanes<S>, D> {
    let mut over = scaled(&at.stress, series.prony.instantaneous() - 1.0);
    let across = at.stress_across(law);
    for (k, term) in series.prony.terms().iter().enumerate() {
        let term_stresses = &internal[series.states_of(k)..];
        let mut q = slots.load(term_stresses);
        subtract(&mut over, &q);
        for (q, s) in q.iter_mut().flatten().zip(at.stress.iter().flatten()) {
            *q = term.rate(*s, *q);
        }
        let q_across = match across {
            Some(s) => {
                let component = Slots::<S, D, N, P>::OUT_OF_PLANE;
                Some(term.rate(s, slots.load_one(component, term_stresses)))
            }
            None => None,
        };
        slots.store((&q, q_across), &mut rates[series.states_of(k)..]);
    }
    over
}

/// Stores Ṡ at a point along several velocities.
#[inline(always)]
fn store_rates<S: Simd, const D: usize, const N: usize, const P: usize, C: Constitutive<D>>(
    law: &C,
    at: &At<S, D, C>,
    point: &Point<D, N, P>,
    slots: &Slots<'_, '_, S, D, N, P>,
    (velocities, out): (&[[[Lanes<S>; D]; N]], &mut [Vec<f64>]),
) {
    let across = at.across(slots.part.law());
    // For many velocities the moduli are evaluated once and contracted with each velocity.
    let moduli = match velocities.len() > UnitStrains::<D>::COUNT {
        true => Some(at.moduli(law, across.as_ref())),
        false => None,
    };
    for (out, v) in out.iter_mut().zip(velocities) {
        let v = slots.part.gradient(v, point);
        let rate = match &moduli {
            Some(moduli) => at.contracted(moduli, &v),
            None => at.stress_rate(law, across.as_ref(), &v),
        };
        slots.store((&rate.0, rate.1), out);
    }
}

/// Returns H for the stress S of the law.
#[inline(always)]
fn overstress<S: Simd, const D: usize, const N: usize, const P: usize>(
    over: Overstress<'_>,
    stress: &Tensor<Lanes<S>, D>,
    series: &RelaxationRegion,
    slots: &Slots<'_, '_, S, D, N, P>,
) -> Tensor<Lanes<S>, D> {
    match over {
        Overstress::Given(over) => slots.load(over),
        Overstress::Internal(internal) => {
            let mut over = scaled(stress, series.prony.instantaneous() - 1.0);
            for k in 0..series.prony.terms().len() {
                subtract(&mut over, &slots.load(&internal[series.states_of(k)..]));
            }
            over
        }
    }
}

/// Returns the tangent of F S at constant F.
#[inline(always)]
fn material_tangent<S: Simd, const D: usize, C: Constitutive<D>>(
    law: &C,
    at: &At<S, D, C>,
    zero: Lanes<S>,
) -> Tangent<Lanes<S>, D> {
    let mut a = law.tangent(&at.strain, Volumetric::pressure(zero), None);
    for i in 0..D {
        for j in 0..D {
            for l in 0..D {
                a[i][i][j][l] = a[i][i][j][l] - at.stress[j][l];
            }
        }
    }
    a
}

/// Returns `factor` · `tensor`.
#[inline(always)]
fn scaled<R: Real, const D: usize>(tensor: &Tensor<R, D>, factor: f64) -> Tensor<R, D> {
    let mut out = *tensor;
    for entry in out.iter_mut().flatten() {
        *entry = *entry * factor;
    }
    out
}

#[inline(always)]
fn subtract<R: Real, const D: usize>(from: &mut Tensor<R, D>, tensor: &Tensor<R, D>) {
    for (from, entry) in from.iter_mut().flatten().zip(tensor.iter().flatten()) {
        *from = *from - *entry;
    }
}

/// Adds (∇φ_a · H ∇φ_b) I of one point to the element matrices with a ≤ b.
#[inline(always)]
fn add_geometric<S: Simd, const D: usize, const N: usize, const P: usize>(
    out: &mut Matrix<S, D, N>,
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    h: &Tensor<Lanes<S>, D>,
) {
    let gradients = part.gradients(point);
    let weights = part.weights(point);
    for b in 0..N {
        let mut image = [part.zero(); D];
        for (image, row) in image.iter_mut().zip(h) {
            for (entry, gradient) in row.iter().zip(&gradients[b]) {
                *image = entry.mul_add(*gradient, *image);
            }
        }
        for a in 0..=b {
            let mut product = part.zero();
            for (gradient, image) in gradients[a].iter().zip(&image) {
                product = gradient.mul_add(*image, product);
            }
            for i in 0..D {
                out[a][b][i][i] = weights.mul_add(product, out[a][b][i][i]);
            }
        }
    }
}

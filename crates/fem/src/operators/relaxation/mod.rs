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

use pulp::{Simd, WithSimd};

use crate::material::Real;
use crate::material::tensor::Volumetric;
use crate::operators::constitutive::{
    Constitutive, Tensor, with_plane_law, with_sheet_law, with_spatial_law,
};
use crate::operators::residual::accumulate;
use crate::operators::tangent::{Matrix, add, scatter};
use crate::simd::batch::{Batch, Batches, Part, Point};
use crate::simd::lanes::{Lanes, outlined};
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

/// Pass over the viscoelastic elements.
pub(crate) struct Relax<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) elements: &'a Batches<D, N, P>,
    pub(crate) maps: &'a [ScatterMap<D, N, P>],
    pub(crate) layout: &'a InternalStresses,
    pub(crate) u: &'a [f64],
    pub(crate) requested: Requested<'b>,
}

/// Pass over one batch, compiled as a separate function for each law.
struct Run<'a, 'b, C, const D: usize, const N: usize, const P: usize> {
    law: C,
    batch: &'a Batch<D, N, P>,
    map: &'a ScatterMap<D, N, P>,
    points: &'a [Point<D, N, P>],
    u: &'a [f64],
    series: &'a RelaxationRegion,
    first: usize,
    requested: &'a mut Requested<'b>,
    number: usize,
}

impl<C, const D: usize, const N: usize, const P: usize> Run<'_, '_, C, D, N, P>
where
    C: Constitutive<D>,
{
    /// Computes one part; `columns` is a work buffer for several velocities or forces.
    #[inline(always)]
    fn part<S: Simd>(
        &mut self,
        part: &mut Part<'_, S, D, N, P>,
        columns: &mut Vec<[[Lanes<S>; D]; N]>,
    ) {
        let Self {
            law,
            batch,
            map,
            points,
            series,
            ..
        } = self;
        let full_law = batch.material.law;
        let u = part.gather_vector(Some(self.u));
        let mut local_force = [[part.zero(); D]; N];
        columns.clear();
        match &*self.requested {
            Requested::StressRates { v, .. } => {
                for v in *v {
                    columns.push(part.gather_vector(Some(v)));
                }
            }
            Requested::ForceOf { forces, .. } => columns.resize(forces.len(), local_force),
            _ => {}
        }
        let wants_matrices = matches!(self.requested, Requested::Tangents { .. });
        let zero: Matrix<S, D, N> = [[[[part.zero(); D]; D]; N]; N];
        let mut matrices = crate::operators::tangent::zero_if(wants_matrices, [zero; 2]);
        let width = series.slots.len();
        for (number, point) in points.iter().enumerate() {
            part.move_to(number);
            let slots = Slots {
                part,
                first: self.first + number * batch.count * Slots::<S, D, N, P>::COMPONENTS,
                count: batch.count,
            };
            // Index of the internal stresses of term k at these slots.
            let states = |k: usize| series.states.start + k * width - series.slots.start;
            if let Requested::ForceOf { tensors, .. } = &*self.requested {
                // These forces do not depend on the law.
                let h = part.gradient(&u, point);
                for (local_force, tensors) in columns.iter_mut().zip(*tensors) {
                    accumulate(
                        local_force,
                        part,
                        point,
                        &times_deformation(&h, &slots.load(tensors)),
                    );
                }
                continue;
            }
            let at = At::<S, D, C>::new(law, part, (number, point), &u);
            match self.requested {
                Requested::ForceOf { .. } => {}
                Requested::Vectors {
                    internal,
                    force,
                    rates,
                } => {
                    let mut over = scaled(&at.stress, series.prony.instantaneous() - 1.0);
                    let across = at.stress_across(full_law);
                    for (k, term) in series.prony.terms().iter().enumerate() {
                        let term_stresses = &internal[states(k)..];
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
                        slots.store((&q, q_across), &mut rates[states(k)..]);
                    }
                    if force.is_some() {
                        accumulate(
                            &mut local_force,
                            part,
                            point,
                            &times_deformation(&at.h, &over),
                        );
                    }
                }
                Requested::Stresses { out } => {
                    slots.store((&at.stress, at.stress_across(full_law)), out);
                }
                Requested::StressRates { out, .. } => {
                    let across = at.across(full_law);
                    // For many velocities the moduli are evaluated once and contracted with each
                    // velocity.
                    let moduli = match columns.len() > UnitStrains::<D>::COUNT {
                        true => Some(at.moduli(law, across.as_ref())),
                        false => None,
                    };
                    for (out, v) in out.iter_mut().zip(columns.iter()) {
                        let v = part.gradient(v, point);
                        let rate = match &moduli {
                            Some(moduli) => at.contracted(moduli, &v),
                            None => at.stress_rate(law, across.as_ref(), &v),
                        };
                        slots.store((&rate.0, rate.1), out);
                    }
                }
                Requested::Tangents { over, .. } => {
                    let Some([material, geometric]) = &mut matrices else {
                        continue;
                    };
                    let over = match over {
                        Overstress::Given(over) => slots.load(over),
                        Overstress::Internal(internal) => {
                            let instantaneous = series.prony.instantaneous();
                            let mut over = scaled(&at.stress, instantaneous - 1.0);
                            for k in 0..series.prony.terms().len() {
                                subtract(&mut over, &slots.load(&internal[states(k)..]));
                            }
                            over
                        }
                    };
                    let mut a = law.tangent(&at.strain, Volumetric::pressure(part.zero()));
                    for i in 0..D {
                        for j in 0..D {
                            for l in 0..D {
                                a[i][i][j][l] = a[i][i][j][l] - at.stress[j][l];
                            }
                        }
                    }
                    add(material, part, point, &a);
                    add_geometric(geometric, part, point, &over);
                }
            }
        }
        match self.requested {
            Requested::Vectors { force, .. } => {
                if let Some(force) = force {
                    part.scatter_vector(&local_force, force);
                }
            }
            Requested::ForceOf { forces, .. } => {
                for (local_force, force) in columns.iter().zip(forces.iter_mut()) {
                    part.scatter_vector(local_force, force);
                }
            }
            Requested::Stresses { .. } | Requested::StressRates { .. } => {}
            Requested::Tangents {
                geometric,
                material,
                ..
            } => {
                if let Some([local_material, local_geometric]) = &matrices {
                    scatter(part, map, local_material, &mut material[self.number]);
                    scatter(part, map, local_geometric, geometric);
                }
            }
        }
    }
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

/// Subtracts `tensor` from `from`.
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

impl<C, const D: usize, const N: usize, const P: usize> WithSimd for Run<'_, '_, C, D, N, P>
where
    C: Constitutive<D>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let mut columns = Vec::new();
        for part in 0..self.batch.n_parts(simd) {
            let part = &mut self.batch.part(simd, part);
            self.part(part, &mut columns);
        }
    }
}

/// Implements the pass for one element type; `$with_law` binds its laws.
macro_rules! pass {
    ($dimension:literal, $nodes:literal, $pressures:literal, $with_law:ident) => {
        impl WithSimd for Relax<'_, '_, $dimension, $nodes, $pressures> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(mut self, simd: S) {
                let Self {
                    elements: Batches { points, batches },
                    maps,
                    layout,
                    u,
                    ref mut requested,
                } = self;
                for (index, batch) in batches.iter().enumerate() {
                    let Some(number) = batch.material.prony else {
                        continue;
                    };
                    $with_law!(batch.material.law, law => outlined(
                        simd,
                        Run::<_, $dimension, $nodes, $pressures> {
                            law,
                            batch,
                            map: &maps[index],
                            points,
                            u,
                            series: &layout.parts[number],
                            first: layout.first[index],
                            requested,
                            number,
                        },
                    ));
                }
            }
        }
    };
}

pass!(2, 3, 3, with_sheet_law);
pass!(2, 6, 3, with_plane_law);
pass!(3, 4, 4, with_spatial_law);
pass!(3, 10, 4, with_spatial_law);

//! Viscoelastic stress described by Prony series, with internal stresses at the quadrature points.
//!
//! With the second Piola–Kirchhoff stress S of the law (without the pressure term) and H = Σ g S − Σ Q, the stress
//!
//! ```text
//! P = F H,        Q̇_k = (g_k S − Q_k)/τ_k
//! ```
//!
//! is added in regions with a Prony series. [`Prony`](crate::material::Prony) describes the treatment of this
//! stress in Newton's method. In 2D, the out-of-plane component is also stored: no force depends on it, but the
//! stress output does. Bodies without Prony series skip this pass.

mod layout;
mod point;

use pulp::Simd;

use crate::material::Real;
use crate::material::tensor::Volumetric;
use crate::operators::constitutive::{Constitutive, Tensor};
use crate::operators::fields::Inverted;
use crate::operators::pass::Kernel;
use crate::operators::residual::accumulate;
use crate::operators::tangent::{Matrix, add, scatter};
use crate::simd::batch::{Part, Point};
use crate::simd::lanes::Lanes;
use crate::space::sparsity::ScatterMap;
pub(crate) use layout::InternalStresses;
pub use layout::RelaxationRegion;
use point::{At, Slots, UnitStrains, times_deformation};

/// The overstress H = Σ g S − Σ Q.
#[derive(Debug, Clone, Copy)]
pub enum Overstress<'a> {
    /// The overstress is computed from all internal stresses Q.
    Internal(&'a [f64]),
    /// The values of H at the slots are given.
    Given(&'a [f64]),
}

/// Requested results of a pass. Results are added to nodal vectors and matrices; other buffers are overwritten.
pub(crate) enum Requested<'a> {
    /// Force ∫ F H : ∇φ and rates Q̇.
    Vectors { internal: &'a [f64], force: Option<&'a mut [f64]>, rates: &'a mut [f64] },
    /// Stress S at the slots.
    Stresses { out: &'a mut [f64] },
    /// Forces ∫ F T : ∇φ of several tensors T, which are given at the slots.
    ForceOf { tensors: &'a [Vec<f64>], forces: &'a mut [Vec<f64>] },
    /// Stress rates Ṡ at the slots along several nodal velocities.
    StressRates { v: &'a [Vec<f64>], out: &'a mut [Vec<f64>] },
    /// Tangents ∂/∂u of ∫ F H : ∇φ at constant H, and, for each region, of ∫ F S : ∇φ at constant F.
    Tangents { over: Overstress<'a>, geometric: &'a mut [f64], material: &'a mut [Vec<f64>] },
}

/// Kernel for the viscoelastic elements.
pub(crate) struct Relax<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) maps: &'a [ScatterMap<D, N, P>],
    pub(crate) layout: &'a InternalStresses,
    pub(crate) u: &'a [f64],
    pub(crate) requested: Requested<'b>,
}

impl<const D: usize, const N: usize, const P: usize> Kernel<D, N, P> for Relax<'_, '_, D, N, P> {
    /// Nodal values of several velocities or forces.
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
        let (map, first) = (&self.maps[batch], self.layout.first[batch]);
        let series = &self.layout.parts[region];
        let count = part.batch.count;
        let full_law = part.law();
        let u = part.gather_vector(Some(self.u));
        let mut local_force = [[part.zero(); D]; N];
        columns.clear();
        match &self.requested {
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
                first: first + number * count * Slots::<S, D, N, P>::COMPONENTS,
                count,
            };
            // First index of the internal stresses of term k at these slots.
            let states = |k: usize| series.states.start + k * width - series.slots.start;
            if let Requested::ForceOf { tensors, .. } = &self.requested {
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
            match &mut self.requested {
                Requested::ForceOf { .. } => {}
                Requested::Vectors { internal, force, rates } => {
                    let mut over = scaled(&at.stress, series.prony.instantaneous() - 1.0);
                    let out_of_plane = at.stress_out_of_plane(full_law);
                    for (k, term) in series.prony.terms().iter().enumerate() {
                        let term_stresses = &internal[states(k)..];
                        let mut q = slots.load(term_stresses);
                        subtract(&mut over, &q);
                        for (q, s) in q.iter_mut().flatten().zip(at.stress.iter().flatten()) {
                            *q = term.rate(*s, *q);
                        }
                        let q_out_of_plane = match out_of_plane {
                            Some(s) => {
                                let component = Slots::<S, D, N, P>::OUT_OF_PLANE;
                                Some(term.rate(s, slots.load_one(component, term_stresses)))
                            }
                            None => None,
                        };
                        slots.store((&q, q_out_of_plane), &mut rates[states(k)..]);
                    }
                    if force.is_some() {
                        accumulate(&mut local_force, part, point, &times_deformation(&at.h, &over));
                    }
                }
                Requested::Stresses { out } => {
                    slots.store((&at.stress, at.stress_out_of_plane(full_law)), out);
                }
                Requested::StressRates { out, .. } => {
                    let out_of_plane = at.out_of_plane(full_law);
                    // For many velocities, the moduli are evaluated once and contracted with each velocity.
                    let moduli = match columns.len() > UnitStrains::<D>::COUNT {
                        true => Some(at.moduli(law, out_of_plane.as_ref())),
                        false => None,
                    };
                    for (out, v) in out.iter_mut().zip(columns.iter()) {
                        let v = part.gradient(v, point);
                        let rate = match &moduli {
                            Some(moduli) => at.contracted(moduli, &v),
                            None => at.stress_rate(law, out_of_plane.as_ref(), &v),
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
                    let mut a = law.tangent(&at.strain, Volumetric::pressure(part.zero()), None);
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
        match &mut self.requested {
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
            Requested::Tangents { geometric, material, .. } => {
                if let Some([local_material, local_geometric]) = &matrices {
                    scatter::<S, D, N, P, true>(part, map, local_material, &mut material[region]);
                    scatter::<S, D, N, P, true>(part, map, local_geometric, geometric);
                }
            }
        }
        Ok(())
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

#[inline(always)]
fn subtract<R: Real, const D: usize>(from: &mut Tensor<R, D>, tensor: &Tensor<R, D>) {
    for (from, entry) in from.iter_mut().flatten().zip(tensor.iter().flatten()) {
        *from = *from - *entry;
    }
}

/// Adds (∇φ_a · H ∇φ_b) I at one point to the element matrices with a ≤ b.
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

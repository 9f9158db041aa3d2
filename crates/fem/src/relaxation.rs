//! Stress that relaxes by Prony terms: internal stresses at the quadrature points.
//!
//! With the law's second Piola–Kirchhoff stress S, without the pressure's part, and H = Σ g S − Σ Q
//!
//! ```text
//! P = F H,        Q̇_k = (g_k S − Q_k)/τ_k
//! ```
//!
//! is added in the regions that have terms; see [`Prony`] for what becomes of it in Newton's method.
//! A plane body keeps the component across its plane too: no force depends on it, but whoever reads the
//! stress does. A body without terms has no pass.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::batch::{Batch, Batches, Part, Point};
use crate::constitutive::{Constitutive, Spatial, Tensor, with_plane_law, with_spatial_law};
use crate::lanes::{Lanes, outlined};
use crate::material::tensor::Volumetric;
use crate::material::three::{Axes, Tensor3};
use crate::material::{Law, Prony, Real};
use crate::residual::accumulate;
use crate::sparsity::ScatterMap;
use crate::tangent::{Matrix, add, scatter};

/// The elements with the same Prony terms, and where their internal stresses lie.
///
/// A slot is one component of a symmetric tensor at one quadrature point of one element; those that are
/// zero in plane strain have none.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxingPart {
    /// The terms.
    pub prony: Prony,
    /// Its slots among those of the body.
    pub slots: Range<usize>,
    /// Its internal stresses: one at each slot for the first term, then for the second, …
    pub states: Range<usize>,
}

/// Where the internal stresses of a body lie.
#[derive(Debug, Clone, Default)]
pub(crate) struct InternalStresses {
    pub(crate) parts: Vec<RelaxingPart>,
    /// The first slot of each batch that has some.
    first: Vec<usize>,
    /// For each element up to the last that has some: its first slot, and how far the next is.
    strips: Vec<Option<[usize; 2]>>,
}

/// The places of the components of a symmetric tensor among the slots of a point, by row and column.
const fn places(dimension: usize) -> &'static [[usize; 2]] {
    match dimension {
        2 => &[[0, 0], [0, 1], [1, 1], [2, 2]],
        _ => &[[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]],
    }
}

impl InternalStresses {
    /// One part for each of `prony`.
    pub(crate) fn new<const D: usize, const N: usize, const P: usize>(
        elements: &Batches<D, N, P>,
        prony: &[Prony],
    ) -> Self {
        let mut first = vec![0; elements.batches.len()];
        let mut strips = Vec::new();
        let (mut slot, mut state) = (0, 0);
        let mut part = |(number, prony): (usize, &Prony)| {
            let start = slot;
            let batches = elements.batches.iter().zip(&mut first);
            for (batch, first) in batches.filter(|(b, _)| b.kind.relaxing == Some(number)) {
                *first = slot;
                for (lane, &element) in batch.elements[..batch.count].iter().enumerate() {
                    strips.resize(strips.len().max(element + 1), None);
                    strips[element] = Some([slot + lane, batch.count]);
                }
                slot += elements.points.len() * batch.count * places(D).len();
            }
            let states = state..state + prony.terms().len() * (slot - start);
            state = states.end;
            RelaxingPart {
                prony: prony.clone(),
                slots: start..slot,
                states,
            }
        };
        let parts = prony.iter().enumerate().map(&mut part).collect();
        Self {
            parts,
            first,
            strips,
        }
    }

    /// Σ Q at the quadrature points of an element, those of the first before the others; nothing for an
    /// element without terms.
    pub(crate) fn sums<'a>(
        &'a self,
        (dimension, element): (usize, usize),
        internal: &'a [f64],
    ) -> Option<(&'a Prony, impl Fn(usize) -> Tensor3 + 'a)> {
        let [first, stride] = (*self.strips.get(element)?)?;
        let mut parts = self.parts.iter();
        let part = parts.find(|part| part.slots.contains(&first))?;
        let of_part = &internal[part.states.clone()];
        let sum = move |point: usize| {
            let mut tensor = [[0.0; 3]; 3];
            let components = places(dimension);
            for (number, &[i, j]) in components.iter().enumerate() {
                let slot = first + (point * components.len() + number) * stride;
                let terms = of_part.chunks(part.slots.len());
                tensor[i][j] = terms.map(|term| term[slot - part.slots.start]).sum();
                tensor[j][i] = tensor[i][j];
            }
            tensor
        };
        Some((&part.prony, sum))
    }
}

/// H = Σ g S − Σ Q, by what is known of it.
#[derive(Debug, Clone, Copy)]
pub enum Overstress<'a> {
    /// All Q.
    Internal(&'a [f64]),
    /// H itself, at the slots.
    Given(&'a [f64]),
}

/// What a pass is to compute; vectors of nodes and matrices are added to, the others overwritten.
pub(crate) enum Wanted<'a> {
    /// ∫ F H : ∇φ, and Q̇.
    Vectors {
        internal: &'a [f64],
        force: Option<&'a mut [f64]>,
        rates: &'a mut [f64],
    },
    /// S at the slots.
    Stresses { out: &'a mut [f64] },
    /// ∫ F T : ∇φ of tensors T at the slots.
    ForceOf {
        tensors: &'a [f64],
        force: &'a mut [f64],
    },
    /// Ṡ along each of at most two nodal velocities, at the slots.
    StressRates {
        v: &'a [Vec<f64>],
        out: &'a mut [Vec<f64>],
    },
    /// ∂/∂u of ∫ F H : ∇φ under constant H, and of ∫ F S : ∇φ under constant F for each part.
    Tangents {
        over: Overstress<'a>,
        geometric: &'a mut [f64],
        material: &'a mut [Vec<f64>],
    },
}

/// A pass over the elements with Prony terms.
pub(crate) struct Relax<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) elements: &'a Batches<D, N, P>,
    pub(crate) maps: &'a [ScatterMap<D, N, P>],
    pub(crate) layout: &'a InternalStresses,
    pub(crate) u: &'a [f64],
    pub(crate) wanted: Wanted<'b>,
}

/// The pass over one batch, a function of its own for each law.
struct Run<'a, 'b, C, const D: usize, const N: usize, const P: usize> {
    law: C,
    batch: &'a Batch<D, N, P>,
    map: &'a ScatterMap<D, N, P>,
    points: &'a [Point<D, N, P>],
    u: &'a [f64],
    series: &'a RelaxingPart,
    first: usize,
    wanted: &'a mut Wanted<'b>,
    number: usize,
}

/// A law's state at a point: F − I, N = cof F, J and S.
struct At<S: Simd, const D: usize, C: Constitutive<D>> {
    h: Tensor<Lanes<S>, D>,
    strain: C::Strain<S>,
    normal: Tensor<Lanes<S>, D>,
    inverse_jacobian: Lanes<S>,
    stress: Tensor<Lanes<S>, D>,
    axes: Axes<Lanes<S>>,
}

impl<S: Simd, const D: usize, C: Constitutive<D>> At<S, D, C> {
    #[inline(always)]
    fn new<const N: usize, const P: usize>(
        law: &C,
        part: &Part<'_, S, D, N, P>,
        (number, point): (usize, &Point<D, N, P>),
        u: &[[Lanes<S>; D]; N],
    ) -> Self {
        let axes = match law.has_fibres() {
            true => part.axes(number),
            false => Axes::cartesian(part.zero()),
        };
        let h = part.gradient(u, point);
        let strain = law.strain(h, axes, None);
        let d = law.dilation(&strain);
        let mut at = Self {
            h,
            normal: law.normal(&strain),
            inverse_jacobian: d.like(1.0) / (d + d.like(1.0)),
            stress: h,
            strain,
            axes,
        };
        let piola = law.stress(&at.strain, no_pressure(d.like(0.0)));
        at.stress = at.pulled_back(&piola);
        at
    }

    /// The component of S across the plane of a plane body, or its rate along V: F33 = 1 there, so that
    /// it is that of P.
    #[inline(always)]
    fn across(&self, law: Law, v: Option<&Tensor<Lanes<S>, D>>) -> Option<Lanes<S>> {
        if D != 2 {
            return None;
        }
        let zero = self.inverse_jacobian.like(0.0);
        let deep = |t: &Tensor<Lanes<S>, D>| {
            let mut out = [[zero; 3]; 3];
            for (out, row) in out.iter_mut().zip(t) {
                out[..D].copy_from_slice(row);
            }
            out
        };
        let law = Spatial(law);
        let strain = law.strain(deep(&self.h), self.axes, None);
        let piola = match v {
            None => law.stress(&strain, no_pressure(zero)),
            Some(v) => law.stress_rate(&strain, deep(v), no_pressure(zero)),
        };
        Some(piola[2][2])
    }

    /// F⁻¹ T = Nᵀ T/J.
    #[inline(always)]
    fn pulled_back(&self, t: &Tensor<Lanes<S>, D>) -> Tensor<Lanes<S>, D> {
        let mut out = *t;
        for i in 0..D {
            for j in 0..D {
                let mut sum = self.normal[0][i] * t[0][j];
                for k in 1..D {
                    sum = self.normal[k][i].mul_add(t[k][j], sum);
                }
                out[i][j] = sum * self.inverse_jacobian;
            }
        }
        out
    }

    /// Ṡ = F⁻¹ (Ṗ − V S).
    #[inline(always)]
    fn stress_rate(&self, law: &C, v: &Tensor<Lanes<S>, D>) -> Tensor<Lanes<S>, D> {
        let zero = self.inverse_jacobian.like(0.0);
        let mut rate = law.stress_rate(&self.strain, *v, no_pressure(zero));
        for i in 0..D {
            for j in 0..D {
                for k in 0..D {
                    rate[i][j] = rate[i][j] - v[i][k] * self.stress[k][j];
                }
            }
        }
        self.pulled_back(&rate)
    }
}

/// F T, F = I + h.
#[inline(always)]
fn pushed<R: Real, const D: usize>(h: &Tensor<R, D>, t: &Tensor<R, D>) -> Tensor<R, D> {
    let mut out = *t;
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                out[i][j] = h[i][k].mul_add(t[k][j], out[i][j]);
            }
        }
    }
    out
}

#[inline(always)]
fn no_pressure<R: Real>(zero: R) -> Volumetric<R> {
    Volumetric {
        p: zero,
        p_rate: zero,
        kappa: 0.0,
    }
}

/// The slots of one part of a batch at one point.
struct Slots<'a, 'p, S: Simd, const D: usize, const N: usize, const P: usize> {
    part: &'a Part<'p, S, D, N, P>,
    first: usize,
    count: usize,
}

impl<S: Simd, const D: usize, const N: usize, const P: usize> Slots<'_, '_, S, D, N, P> {
    /// Number of components.
    const COMPONENTS: usize = places(D).len();
    /// The place of the one across a plane.
    const ACROSS: usize = Self::COMPONENTS - 1;

    /// Where a component lies.
    #[inline(always)]
    fn range(&self, component: usize) -> Range<usize> {
        let (start, lanes) = (self.first + component * self.count, self.part.occupied());
        start + lanes.start..start + lanes.end
    }

    #[inline(always)]
    fn load_one(&self, component: usize, values: &[f64]) -> Lanes<S> {
        let mut value = self.part.zero();
        let own = &values[self.range(component)];
        match own.len() == S::F64_LANES {
            // One instruction.
            true => value.as_mut_slice().copy_from_slice(&own[..S::F64_LANES]),
            false => value.as_mut_slice()[..own.len()].copy_from_slice(own),
        }
        value
    }

    #[inline(always)]
    fn store_one(&self, component: usize, value: Lanes<S>, values: &mut [f64]) {
        let own = &mut values[self.range(component)];
        let value = value.as_slice();
        match own.len() == S::F64_LANES {
            true => own[..S::F64_LANES].copy_from_slice(value),
            false => own.copy_from_slice(&value[..own.len()]),
        }
    }

    /// The symmetric tensor at these slots, in the dimensions of the body.
    #[inline(always)]
    fn load(&self, values: &[f64]) -> Tensor<Lanes<S>, D> {
        let mut tensor = [[self.part.zero(); D]; D];
        let mut component = 0;
        for i in 0..D {
            for j in i..D {
                let value = self.load_one(component, values);
                tensor[i][j] = value;
                tensor[j][i] = value;
                component += 1;
            }
        }
        tensor
    }

    /// The same, with the component across the plane of a plane body.
    #[inline(always)]
    fn store(
        &self,
        (tensor, across): (&Tensor<Lanes<S>, D>, Option<Lanes<S>>),
        values: &mut [f64],
    ) {
        let mut component = 0;
        for (i, row) in tensor.iter().enumerate() {
            for value in &row[i..] {
                self.store_one(component, *value, values);
                component += 1;
            }
        }
        if let Some(across) = across {
            self.store_one(Self::ACROSS, across, values);
        }
    }
}

impl<C, const D: usize, const N: usize, const P: usize> Run<'_, '_, C, D, N, P>
where
    C: Constitutive<D>,
{
    #[inline(always)]
    fn part<S: Simd>(&mut self, part: &mut Part<'_, S, D, N, P>) {
        let Self {
            law,
            batch,
            map,
            points,
            series,
            ..
        } = self;
        let any = batch.kind.law;
        let u = part.gather_vector(Some(self.u));
        let velocity = |k: usize| match &*self.wanted {
            Wanted::StressRates { v, .. } => v.get(k).map(|v| &v[..]),
            _ => None,
        };
        let v = [
            part.gather_vector(velocity(0)),
            part.gather_vector(velocity(1)),
        ];
        let mut local_force = [[part.zero(); D]; N];
        let wants_matrices = matches!(self.wanted, Wanted::Tangents { .. });
        let zero: Matrix<S, D, N> = [[[[part.zero(); D]; D]; N]; N];
        let mut matrices = crate::tangent::room(wants_matrices, [zero; 2]);
        let width = series.slots.len();
        for (number, point) in points.iter().enumerate() {
            part.move_to(number);
            let slots = Slots {
                part,
                first: self.first + number * batch.count * Slots::<S, D, N, P>::COMPONENTS,
                count: batch.count,
            };
            // The states of term k at these slots.
            let states = |k: usize| series.states.start + k * width - series.slots.start;
            if let Wanted::ForceOf { tensors, .. } = &*self.wanted {
                // The law has no part in it.
                let stress = pushed(&part.gradient(&u, point), &slots.load(tensors));
                accumulate(&mut local_force, part, point, &stress);
                continue;
            }
            let at = At::<S, D, C>::new(law, part, (number, point), &u);
            match self.wanted {
                Wanted::ForceOf { .. } => {}
                Wanted::Vectors {
                    internal,
                    force,
                    rates,
                } => {
                    let mut over = scaled(&at.stress, series.prony.instantaneous() - 1.0);
                    let across = at.across(any, None);
                    for (k, term) in series.prony.terms().iter().enumerate() {
                        let own = &internal[states(k)..];
                        let mut q = slots.load(own);
                        subtract(&mut over, &q);
                        for (q, s) in q.iter_mut().flatten().zip(at.stress.iter().flatten()) {
                            *q = term.rate(*s, *q);
                        }
                        let q_across = match across {
                            Some(s) => {
                                let place = Slots::<S, D, N, P>::ACROSS;
                                Some(term.rate(s, slots.load_one(place, own)))
                            }
                            None => None,
                        };
                        slots.store((&q, q_across), &mut rates[states(k)..]);
                    }
                    if force.is_some() {
                        accumulate(&mut local_force, part, point, &pushed(&at.h, &over));
                    }
                }
                Wanted::Stresses { out } => slots.store((&at.stress, at.across(any, None)), out),
                Wanted::StressRates { out, .. } => {
                    for (out, v) in out.iter_mut().zip(&v) {
                        let v = part.gradient(v, point);
                        let rate = at.stress_rate(law, &v);
                        slots.store((&rate, at.across(any, Some(&v))), out);
                    }
                }
                Wanted::Tangents { over, .. } => {
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
                    let mut a = law.tangent(&at.strain, no_pressure(part.zero()));
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
        match self.wanted {
            Wanted::Vectors { force, .. } => {
                if let Some(force) = force {
                    part.scatter_vector(&local_force, force);
                }
            }
            Wanted::ForceOf { force, .. } => part.scatter_vector(&local_force, force),
            Wanted::Stresses { .. } | Wanted::StressRates { .. } => {}
            Wanted::Tangents {
                geometric,
                material,
                ..
            } => {
                if let Some([of_material, of_geometric]) = &matrices {
                    scatter(part, map, of_material, &mut material[self.number]);
                    scatter(part, map, of_geometric, geometric);
                }
            }
        }
    }
}

/// `factor` · `tensor`.
#[inline(always)]
fn scaled<R: Real, const D: usize>(tensor: &Tensor<R, D>, factor: f64) -> Tensor<R, D> {
    let mut out = *tensor;
    for entry in out.iter_mut().flatten() {
        *entry = *entry * factor;
    }
    out
}

/// `from` −= `tensor`.
#[inline(always)]
fn subtract<R: Real, const D: usize>(from: &mut Tensor<R, D>, tensor: &Tensor<R, D>) {
    for (from, entry) in from.iter_mut().flatten().zip(tensor.iter().flatten()) {
        *from = *from - *entry;
    }
}

/// Adds (∇φ_a · H ∇φ_b) I of one point to the element matrices, those with a ≤ b.
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
        for part in 0..self.batch.n_parts(simd) {
            let part = &mut self.batch.part(simd, part);
            self.part(part);
        }
    }
}

/// The pass in one dimension; `$with_law` binds the laws of that dimension.
macro_rules! pass {
    ($dimension:literal, $with_law:ident) => {
        impl<const N: usize, const P: usize> WithSimd for Relax<'_, '_, $dimension, N, P> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(mut self, simd: S) {
                let Self {
                    elements: Batches { points, batches },
                    maps,
                    layout,
                    u,
                    ref mut wanted,
                } = self;
                for (place, batch) in batches.iter().enumerate() {
                    let Some(number) = batch.kind.relaxing else {
                        continue;
                    };
                    $with_law!(batch.kind.law, law => outlined(
                        simd,
                        Run::<_, $dimension, N, P> {
                            law,
                            batch,
                            map: &maps[place],
                            points,
                            u,
                            series: &layout.parts[number],
                            first: layout.first[place],
                            wanted,
                            number,
                        },
                    ));
                }
            }
        }
    };
}

pass!(2, with_plane_law);
pass!(3, with_spatial_law);

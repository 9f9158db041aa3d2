//! What a pass works with at one quadrature point: the law's stress, and the slots of internal stresses.

use std::ops::Range;

use pulp::Simd;

use super::layout::places;
use crate::batch::{Part, Point};
use crate::constitutive::{Constitutive, Spatial, Tensor};
use crate::lanes::Lanes;
use crate::material::tensor::Volumetric;
use crate::material::three::Axes;
use crate::material::{Law, Real};

/// A law's state at a point: F − I, N = cof F, J and S.
pub(super) struct At<S: Simd, const D: usize, C: Constitutive<D>> {
    pub(super) h: Tensor<Lanes<S>, D>,
    pub(super) strain: C::Strain<S>,
    normal: Tensor<Lanes<S>, D>,
    inverse_jacobian: Lanes<S>,
    pub(super) stress: Tensor<Lanes<S>, D>,
    axes: Axes<Lanes<S>>,
}

impl<S: Simd, const D: usize, C: Constitutive<D>> At<S, D, C> {
    #[inline(always)]
    pub(super) fn new<const N: usize, const P: usize>(
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
        let piola = law.stress(&at.strain, Volumetric::pressure(d.like(0.0)));
        at.stress = at.pulled_back(&piola);
        at
    }

    /// The component of S across the plane of a plane body, or its rate along V: F33 = 1 there, so that
    /// it is that of P.
    #[inline(always)]
    pub(super) fn across(&self, law: Law, v: Option<&Tensor<Lanes<S>, D>>) -> Option<Lanes<S>> {
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
            None => law.stress(&strain, Volumetric::pressure(zero)),
            Some(v) => law.stress_rate(&strain, deep(v), Volumetric::pressure(zero)),
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
    pub(super) fn stress_rate(&self, law: &C, v: &Tensor<Lanes<S>, D>) -> Tensor<Lanes<S>, D> {
        let zero = self.inverse_jacobian.like(0.0);
        let mut rate = law.stress_rate(&self.strain, *v, Volumetric::pressure(zero));
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
pub(super) fn pushed<R: Real, const D: usize>(h: &Tensor<R, D>, t: &Tensor<R, D>) -> Tensor<R, D> {
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

/// The slots of one part of a batch at one point.
pub(super) struct Slots<'a, 'p, S: Simd, const D: usize, const N: usize, const P: usize> {
    pub(super) part: &'a Part<'p, S, D, N, P>,
    pub(super) first: usize,
    pub(super) count: usize,
}

impl<S: Simd, const D: usize, const N: usize, const P: usize> Slots<'_, '_, S, D, N, P> {
    /// Number of components.
    pub(super) const COMPONENTS: usize = places(D).len();
    /// The place of the one across a plane.
    pub(super) const ACROSS: usize = Self::COMPONENTS - 1;

    /// Where a component lies.
    #[inline(always)]
    fn range(&self, component: usize) -> Range<usize> {
        let (start, lanes) = (self.first + component * self.count, self.part.occupied());
        start + lanes.start..start + lanes.end
    }

    #[inline(always)]
    pub(super) fn load_one(&self, component: usize, values: &[f64]) -> Lanes<S> {
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
    pub(super) fn load(&self, values: &[f64]) -> Tensor<Lanes<S>, D> {
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
    pub(super) fn store(
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

//! Stress of the law and slots of internal stresses at a quadrature point.

use std::ops::Range;

use pulp::Simd;

use super::layout::component_indices;
use crate::material::tensor::Volumetric;
use crate::material::three::Axes;
use crate::material::{Law, Real};
use crate::operators::constitutive::{Constitutive, Spatial, Tensor, in_space};
use crate::simd::batch::{Part, Point};
use crate::simd::lanes::Lanes;

/// State of a law at a point: F − I, cof F, 1/J and S.
pub(super) struct At<S: Simd, const D: usize, C: Constitutive<D>> {
    pub(super) h: Tensor<Lanes<S>, D>,
    pub(super) strain: C::Strain<S>,
    cofactor: Tensor<Lanes<S>, D>,
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
        let axes = part.axes(number, law.has_fibers());
        let h = part.gradient(u, point);
        let strain = law.strain(h, axes, None);
        let d = law.dilation(&strain);
        let mut at = Self {
            h,
            cofactor: law.cofactor(&strain),
            inverse_jacobian: d.like(1.0) / (d + d.like(1.0)),
            stress: h,
            strain,
            axes,
        };
        let piola = law.stress(&at.strain, Volumetric::pressure(d.like(0.0)), None);
        at.stress = at.pulled_back(&piola);
        at
    }

    /// Returns the 3D state of a plane body, from which out-of-plane components are computed.
    #[inline(always)]
    pub(super) fn out_of_plane(&self, law: Law) -> Option<OutOfPlane<S>> {
        if D != 2 {
            return None;
        }
        let law = Spatial::new(law);
        let h = in_space(&self.h, self.inverse_jacobian.like(0.0));
        Some(OutOfPlane { law, strain: law.strain(h, self.axes, None) })
    }

    /// Returns the out-of-plane component of S of a plane body.
    #[inline(always)]
    pub(super) fn stress_out_of_plane(&self, law: Law) -> Option<Lanes<S>> {
        let out_of_plane = self.out_of_plane(law)?;
        Some(out_of_plane.stress::<D>(None))
    }

    /// Returns F⁻¹ T = Nᵀ T/J with N = cof F.
    #[inline(always)]
    fn pulled_back(&self, t: &Tensor<Lanes<S>, D>) -> Tensor<Lanes<S>, D> {
        let mut out = *t;
        for i in 0..D {
            for j in 0..D {
                let mut sum = self.cofactor[0][i] * t[0][j];
                for k in 1..D {
                    sum = self.cofactor[k][i].mul_add(t[k][j], sum);
                }
                out[i][j] = sum * self.inverse_jacobian;
            }
        }
        out
    }

    /// Returns Ṡ = F⁻¹ (Ṗ − V S) and its out-of-plane component.
    #[inline(always)]
    pub(super) fn stress_rate(
        &self,
        law: &C,
        out_of_plane: Option<&OutOfPlane<S>>,
        v: &Tensor<Lanes<S>, D>,
    ) -> Rate<S, D> {
        let zero = self.inverse_jacobian.like(0.0);
        let mut rate = law.stress(&self.strain, Volumetric::pressure(zero), Some(v));
        for i in 0..D {
            for j in 0..D {
                for k in 0..D {
                    rate[i][j] = rate[i][j] - v[i][k] * self.stress[k][j];
                }
            }
        }
        let out_of_plane = match out_of_plane {
            Some(out_of_plane) => Some(out_of_plane.stress(Some(v))),
            None => None,
        };
        (self.pulled_back(&rate), out_of_plane)
    }

    /// Returns ∂S/∂E for a law that depends only on FᵀF = I + 2 E. The derivative along each [unit
    /// strain](UnitStrains) e is Ṡ along V = F⁻ᵀ e.
    #[inline(always)]
    pub(super) fn moduli(&self, law: &C, out_of_plane: Option<&OutOfPlane<S>>) -> [Rate<S, D>; 6] {
        let zero = self.inverse_jacobian.like(0.0);
        let mut moduli = [([[zero; D]; D], None); 6];
        for (moduli, &[k, l]) in moduli.iter_mut().zip(UnitStrains::<D>::INDICES) {
            let mut v = [[zero; D]; D];
            for (v, cofactor) in v.iter_mut().zip(&self.cofactor) {
                v[k] = cofactor[l] * self.inverse_jacobian;
                v[l] = cofactor[k] * self.inverse_jacobian;
            }
            *moduli = self.stress_rate(law, out_of_plane, &v);
        }
        moduli
    }

    /// Returns Ṡ = ∂S/∂E : Ė, where Ė is the symmetric part of Fᵀ V.
    #[inline(always)]
    pub(super) fn contracted(
        &self,
        moduli: &[Rate<S, D>; 6],
        v: &Tensor<Lanes<S>, D>,
    ) -> Rate<S, D> {
        let zero = self.inverse_jacobian.like(0.0);
        let mut sum = ([[zero; D]; D], if D == 2 { Some(zero) } else { None });
        for (modulus, &[k, l]) in moduli.iter().zip(UnitStrains::<D>::INDICES) {
            let mut strain = v[k][l] + v[l][k];
            for (h, v) in self.h.iter().zip(v) {
                strain = h[k].mul_add(v[l], h[l].mul_add(v[k], strain));
            }
            let strain = strain * 0.5;
            for (sum, modulus) in sum.0.iter_mut().flatten().zip(modulus.0.iter().flatten()) {
                *sum = strain.mul_add(*modulus, *sum);
            }
            if let (Some(sum), Some(modulus)) = (&mut sum.1, modulus.1) {
                *sum = strain.mul_add(modulus, *sum);
            }
        }
        sum
    }
}

/// Stress rate Ṡ and, for a plane body, its out-of-plane component.
pub(super) type Rate<S, const D: usize> = (Tensor<Lanes<S>, D>, Option<Lanes<S>>);

/// Basis of symmetric strains. Each basis tensor is 1 in a diagonal entry, or in both entries (k, l) and (l, k).
pub(super) struct UnitStrains<const D: usize>;

impl<const D: usize> UnitStrains<D> {
    const INDICES: &[[usize; 2]] = component_indices(D).split_at(Self::COUNT).0;
    pub(super) const COUNT: usize = D * (D + 1) / 2;
}

/// 3D state of a plane body, from which out-of-plane components are computed. Because F33 = 1, the out-of-plane
/// components of S and P are equal.
pub(super) struct OutOfPlane<S: Simd> {
    law: Spatial,
    strain: <Spatial as Constitutive<3>>::Strain<S>,
}

impl<S: Simd> OutOfPlane<S> {
    /// Returns the stress component, or its rate if a velocity gradient is given.
    #[inline(always)]
    fn stress<const D: usize>(&self, v: Option<&Tensor<Lanes<S>, D>>) -> Lanes<S> {
        let zero = self.law.dilation(&self.strain).like(0.0);
        let v = match v {
            Some(v) => Some(in_space(v, zero)),
            None => None,
        };
        let pressure = Volumetric::pressure(zero);
        self.law.stress(&self.strain, pressure, v.as_ref())[2][2]
    }
}

/// Returns F T for F = I + h.
#[inline(always)]
pub(super) fn times_deformation<R: Real, const D: usize>(
    h: &Tensor<R, D>,
    t: &Tensor<R, D>,
) -> Tensor<R, D> {
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

/// Slots of one part of a batch at a quadrature point.
pub(super) struct Slots<'a, 'p, S: Simd, const D: usize, const N: usize, const P: usize> {
    pub(super) part: &'a Part<'p, S, D, N, P>,
    pub(super) first: usize,
    pub(super) count: usize,
}

impl<S: Simd, const D: usize, const N: usize, const P: usize> Slots<'_, '_, S, D, N, P> {
    pub(super) const COMPONENTS: usize = component_indices(D).len();
    pub(super) const OUT_OF_PLANE: usize = Self::COMPONENTS - 1;

    #[inline(always)]
    fn range(&self, component: usize) -> Range<usize> {
        let (start, lanes) = (self.first + component * self.count, self.part.occupied());
        start + lanes.start..start + lanes.end
    }

    #[inline(always)]
    pub(super) fn load_one(&self, component: usize, values: &[f64]) -> Lanes<S> {
        let mut value = self.part.zero();
        let slots = &values[self.range(component)];
        match slots.len() == S::F64_LANES {
            // A full register is copied by one instruction.
            true => value.as_mut_slice().copy_from_slice(&slots[..S::F64_LANES]),
            false => value.as_mut_slice()[..slots.len()].copy_from_slice(slots),
        }
        value
    }

    #[inline(always)]
    fn store_one(&self, component: usize, value: Lanes<S>, values: &mut [f64]) {
        let slots = &mut values[self.range(component)];
        let value = value.as_slice();
        match slots.len() == S::F64_LANES {
            true => slots[..S::F64_LANES].copy_from_slice(value),
            false => slots.copy_from_slice(&value[..slots.len()]),
        }
    }

    /// Loads the symmetric tensor at these slots, without the out-of-plane component.
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

    /// Stores a symmetric tensor and, for a plane body, its out-of-plane component.
    #[inline(always)]
    pub(super) fn store(
        &self,
        (tensor, out_of_plane): (&Tensor<Lanes<S>, D>, Option<Lanes<S>>),
        values: &mut [f64],
    ) {
        let mut component = 0;
        for (i, row) in tensor.iter().enumerate() {
            for value in &row[i..] {
                self.store_one(component, *value, values);
                component += 1;
            }
        }
        if let Some(out_of_plane) = out_of_plane {
            self.store_one(Self::OUT_OF_PLANE, out_of_plane, values);
        }
    }
}

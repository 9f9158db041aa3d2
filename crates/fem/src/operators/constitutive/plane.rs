//! Isotropic laws in plane strain, given by a potential of two invariants.

use pulp::Simd;

use super::{Constitutive, Tangent, Tensor};
use crate::material::tensor::{
    Strain, Symmetric, UPPER, Volumetric, volume_gradient_rate, volume_tangent,
};
use crate::material::three::Axes;
use crate::material::{Potential, Real};
use crate::simd::lanes::Lanes;

/// Isotropic law in plane strain, given by a potential of two invariants, with the default volume function.
pub(crate) struct Plane<W>(pub(crate) W);

/// Evaluates an expression with `$law` bound to the law of a plane body.
macro_rules! with_plane_law {
    ($material:expr, $law:ident => $body:expr) => {
        match $material {
            material if material.volume_function != Default::default() => {
                let $law = $crate::operators::constitutive::EmbeddedPlane::of(material);
                $body
            }
            material => $crate::material::with_potential!(material.law, w => {
                let $law = $crate::operators::constitutive::Plane(w);
                $body
            }, else => {
                let $law = $crate::operators::constitutive::EmbeddedPlane::of(material);
                $body
            }),
        }
    };
}
pub(crate) use with_plane_law;

/// Expands the packed entries to a full tangent.
#[inline(always)]
fn unfold<R: Real>(a: Symmetric<R>) -> Tangent<R, 2> {
    let mut out = [[[[a.0[0]; 2]; 2]; 2]; 2];
    for i in 0..2 {
        for k in 0..2 {
            for j in 0..2 {
                for l in 0..2 {
                    out[i][k][j][l] = a.0[UPPER[2 * i + j][2 * k + l]];
                }
            }
        }
    }
    out
}

impl<W: Potential> Constitutive<2> for Plane<W> {
    #[inline(always)]
    fn is_finite(&self) -> bool {
        W::FINITE
    }

    #[inline(always)]
    fn has_fibers(&self) -> bool {
        false
    }

    type Strain<S: Simd> = Strain<Lanes<S>>;

    #[inline(always)]
    fn strain<S: Simd>(
        &self,
        h: Tensor<Lanes<S>, 2>,
        _: Axes<Lanes<S>>,
        factor: Option<Lanes<S>>,
    ) -> Strain<Lanes<S>> {
        let mut strain = Strain::new(&self.0, h);
        strain.factor = factor;
        strain
    }

    #[inline(always)]
    fn dilation<S: Simd>(&self, strain: &Strain<Lanes<S>>) -> Lanes<S> {
        strain.d
    }

    #[inline(always)]
    fn cofactor<S: Simd>(&self, strain: &Strain<Lanes<S>>) -> Tensor<Lanes<S>, 2> {
        strain.cofactor
    }

    #[inline(always)]
    fn volume<S: Simd>(&self, strain: &Strain<Lanes<S>>) -> Lanes<S> {
        strain.d
    }

    #[inline(always)]
    fn volume_rate<S: Simd>(&self, strain: &Strain<Lanes<S>>, v: Tensor<Lanes<S>, 2>) -> Lanes<S> {
        strain.dilation_rate(v)
    }

    #[inline(always)]
    fn volume_gradient<S: Simd>(
        &self,
        strain: &Strain<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 2>>,
    ) -> Tensor<Lanes<S>, 2> {
        match v {
            None => strain.cofactor,
            Some(v) => volume_gradient_rate(&self.0, *v),
        }
    }

    #[inline(always)]
    fn stress<S: Simd>(
        &self,
        strain: &Strain<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 2>>,
    ) -> Tensor<Lanes<S>, 2> {
        match v {
            None => strain.stress(&self.0, volumetric),
            Some(v) => strain.stress_rate(&self.0, *v, volumetric),
        }
    }

    #[inline(always)]
    fn tangent<S: Simd>(
        &self,
        strain: &Strain<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 2>>,
    ) -> Tangent<Lanes<S>, 2> {
        match v {
            None => unfold(strain.tangent(&self.0, volumetric)),
            Some(v) => unfold(strain.tangent_rate(&self.0, *v, volumetric)),
        }
    }

    #[inline(always)]
    fn volume_tangent<S: Simd>(&self, _: &Strain<Lanes<S>>, m: Lanes<S>) -> Tangent<Lanes<S>, 2> {
        unfold(volume_tangent(&self.0, m))
    }
}

//! Plane strain for laws without a potential of two invariants. The 3D law is evaluated at F33 = 1.

use pulp::Simd;

use super::{Constitutive, Spatial, Tangent, Tensor};
use crate::material::Real;
use crate::material::tensor::Volumetric;
use crate::material::three::{Axes, Strain3};
use crate::simd::lanes::Lanes;
use crate::solid::element_material::ElementMaterial;

/// Law in plane strain, given by the in-plane components of the 3D law. Fibers are in the plane.
#[derive(Clone, Copy)]
pub(crate) struct EmbeddedPlane(Spatial);

/// Embeds a 2D gradient in 3D.
#[inline(always)]
fn embed<R: Real>(h: &Tensor<R, 2>) -> Tensor<R, 3> {
    let zero = h[0][0].like(0.0);
    [[h[0][0], h[0][1], zero], [h[1][0], h[1][1], zero], [zero; 3]]
}

/// Embeds a 2D gradient in 3D, if it is given.
#[inline(always)]
fn embed_some<R: Real>(h: Option<&Tensor<R, 2>>) -> Option<Tensor<R, 3>> {
    match h {
        Some(h) => Some(embed(h)),
        None => None,
    }
}

#[inline(always)]
fn in_plane<R: Real>(t: &Tensor<R, 3>) -> Tensor<R, 2> {
    [[t[0][0], t[0][1]], [t[1][0], t[1][1]]]
}

#[inline(always)]
fn in_plane_tangent<R: Real>(a: &Tangent<R, 3>) -> Tangent<R, 2> {
    let mut out = [[[[a[0][0][0][0]; 2]; 2]; 2]; 2];
    for i in 0..2 {
        for k in i..2 {
            for j in 0..2 {
                for l in 0..2 {
                    out[i][k][j][l] = a[i][k][j][l];
                }
            }
        }
    }
    out
}

/// Evaluates an expression with `$law` bound to a law of linear triangles. These elements only serve as a
/// counterexample for inf–sup constants, so the same loop handles all laws.
macro_rules! with_embedded_law {
    ($material:expr, $law:ident => $body:expr) => {{
        let $law = $crate::operators::constitutive::EmbeddedPlane::of($material);
        $body
    }};
}
pub(crate) use with_embedded_law;

impl EmbeddedPlane {
    #[inline(always)]
    pub(crate) fn of(material: &ElementMaterial) -> Self {
        Self(Spatial::of(material))
    }

    #[inline(always)]
    fn spatial(&self) -> Spatial {
        self.0
    }
}

impl Constitutive<2> for EmbeddedPlane {
    #[inline(always)]
    fn has_fibers(&self) -> bool {
        self.spatial().has_fibers()
    }

    type Strain<S: Simd> = Strain3<Lanes<S>>;

    #[inline(always)]
    fn is_finite(&self) -> bool {
        self.spatial().is_finite()
    }

    #[inline(always)]
    fn strain<S: Simd>(
        &self,
        h: Tensor<Lanes<S>, 2>,
        axes: Axes<Lanes<S>>,
        factor: Option<Lanes<S>>,
    ) -> Strain3<Lanes<S>> {
        self.spatial().strain(embed(&h), axes, factor)
    }

    #[inline(always)]
    fn dilation<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Lanes<S> {
        self.spatial().dilation(strain)
    }

    #[inline(always)]
    fn cofactor<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Tensor<Lanes<S>, 2> {
        in_plane(&self.spatial().cofactor(strain))
    }

    #[inline(always)]
    fn volume<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Lanes<S> {
        self.spatial().volume(strain)
    }

    #[inline(always)]
    fn volume_rate<S: Simd>(&self, strain: &Strain3<Lanes<S>>, v: Tensor<Lanes<S>, 2>) -> Lanes<S> {
        self.spatial().volume_rate(strain, embed(&v))
    }

    #[inline(always)]
    fn volume_gradient<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 2>>,
    ) -> Tensor<Lanes<S>, 2> {
        in_plane(&self.spatial().volume_gradient(strain, embed_some(v).as_ref()))
    }

    #[inline(always)]
    fn stress<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 2>>,
    ) -> Tensor<Lanes<S>, 2> {
        let v = embed_some(v);
        in_plane(&self.spatial().stress(strain, volumetric, v.as_ref()))
    }

    #[inline(always)]
    fn tangent<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 2>>,
    ) -> Tangent<Lanes<S>, 2> {
        let v = embed_some(v);
        in_plane_tangent(&self.spatial().tangent(strain, volumetric, v.as_ref()))
    }

    #[inline(always)]
    fn volume_tangent<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        m: Lanes<S>,
    ) -> Tangent<Lanes<S>, 2> {
        in_plane_tangent(&self.spatial().volume_tangent(strain, m))
    }
}

//! Laws without a potential of two invariants in plane strain: evaluated in space at F33 = 1.

use pulp::Simd;

use super::{Constitutive, Spatial, Tangent, Tensor};
use crate::material::tensor::Volumetric;
use crate::material::three::{Axes, Strain3};
use crate::material::{Law, Real};
use crate::simd::lanes::Lanes;

/// A law in plane strain, the part in the plane of what it is in space. Fibres lie in the plane.
#[derive(Clone, Copy)]
pub(crate) struct Sheet(pub(crate) Law);

/// A gradient with a third row and column of zeros.
#[inline(always)]
fn deep<R: Real>(h: &Tensor<R, 2>) -> Tensor<R, 3> {
    let zero = h[0][0].like(0.0);
    [
        [h[0][0], h[0][1], zero],
        [h[1][0], h[1][1], zero],
        [zero; 3],
    ]
}

/// The part in the plane.
#[inline(always)]
fn flat<R: Real>(t: &Tensor<R, 3>) -> Tensor<R, 2> {
    [[t[0][0], t[0][1]], [t[1][0], t[1][1]]]
}

#[inline(always)]
fn flat_tangent<R: Real>(a: &Tangent<R, 3>) -> Tangent<R, 2> {
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

/// Evaluates an expression with `$law` bound to a law of linear triangles. They serve as the counterexample
/// of inf–sup constants, and need no loop of their own for each law.
macro_rules! with_sheet_law {
    ($any:expr, $law:ident => $body:expr) => {{
        let $law = $crate::operators::constitutive::Sheet($any);
        $body
    }};
}
pub(crate) use with_sheet_law;

impl Sheet {
    #[inline(always)]
    fn spatial(&self) -> Spatial {
        Spatial(self.0)
    }
}

impl Constitutive<2> for Sheet {
    #[inline(always)]
    fn has_fibres(&self) -> bool {
        self.0.has_fibres()
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
        self.spatial().strain(deep(&h), axes, factor)
    }

    #[inline(always)]
    fn dilation<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Lanes<S> {
        self.spatial().dilation(strain)
    }

    #[inline(always)]
    fn normal<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Tensor<Lanes<S>, 2> {
        flat(&self.spatial().normal(strain))
    }

    #[inline(always)]
    fn normal_rate<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        v: Tensor<Lanes<S>, 2>,
    ) -> Tensor<Lanes<S>, 2> {
        flat(&self.spatial().normal_rate(strain, deep(&v)))
    }

    #[inline(always)]
    fn dilation_rate<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        v: Tensor<Lanes<S>, 2>,
    ) -> Lanes<S> {
        self.spatial().dilation_rate(strain, deep(&v))
    }

    #[inline(always)]
    fn stress<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tensor<Lanes<S>, 2> {
        flat(&self.spatial().stress(strain, volumetric))
    }

    #[inline(always)]
    fn stress_rate<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        v: Tensor<Lanes<S>, 2>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tensor<Lanes<S>, 2> {
        flat(&self.spatial().stress_rate(strain, deep(&v), volumetric))
    }

    #[inline(always)]
    fn tangent<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tangent<Lanes<S>, 2> {
        flat_tangent(&self.spatial().tangent(strain, volumetric))
    }

    #[inline(always)]
    fn tangent_rate<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        v: Tensor<Lanes<S>, 2>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tangent<Lanes<S>, 2> {
        flat_tangent(&self.spatial().tangent_rate(strain, deep(&v), volumetric))
    }

    #[inline(always)]
    fn volume_tangent<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        m: Lanes<S>,
    ) -> Tangent<Lanes<S>, 2> {
        flat_tangent(&self.spatial().volume_tangent(strain, m))
    }
}

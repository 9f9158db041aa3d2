//! What the element loops ask of a law at a point, in either dimension.

use crate::material::Potential;
use crate::material::Real;
use crate::material::tensor::{
    Strain, Symmetric, UPPER, Volumetric, volume_gradient_rate, volume_tangent,
};

/// A `D` × `D` tensor of some kind of number.
pub(crate) type Tensor<R, const D: usize> = [[R; D]; D];

/// A symmetric derivative of a tensor by a tensor: entry `[i][k][j][l]` for (i, j) by (k, l). Only
/// that with i ≤ k, and for i = k with j ≤ l, is asked for.
pub(crate) type Tangent<R, const D: usize> = [[[[R; D]; D]; D]; D];

/// A law as the element loops see it.
///
/// H = ∇u, V = ∇v. The functions are called on registers and are inlined.
pub(crate) trait Constitutive<const D: usize> {
    /// Whether strains are finite (d = J − 1) or small (d = div u).
    const FINITE: bool;

    /// The deformation at a point.
    type Strain<R: Real>: Copy;

    /// The deformation for `h`, the law's energy multiplied by `factor`.
    fn strain<R: Real>(&self, h: Tensor<R, D>, factor: Option<R>) -> Self::Strain<R>;

    /// d.
    fn dilation<R: Real>(&self, strain: &Self::Strain<R>) -> R;

    /// N = ∂d/∂F.
    fn normal<R: Real>(&self, strain: &Self::Strain<R>) -> Tensor<R, D>;

    /// Ṅ along V.
    fn normal_rate<R: Real>(&self, strain: &Self::Strain<R>, v: Tensor<R, D>) -> Tensor<R, D>;

    /// ḋ = N : V.
    fn dilation_rate<R: Real>(&self, strain: &Self::Strain<R>, v: Tensor<R, D>) -> R;

    /// P.
    fn stress<R: Real>(&self, strain: &Self::Strain<R>, volumetric: Volumetric<R>) -> Tensor<R, D>;

    /// Ṗ along V and ṗ.
    fn stress_rate<R: Real>(
        &self,
        strain: &Self::Strain<R>,
        v: Tensor<R, D>,
        volumetric: Volumetric<R>,
    ) -> Tensor<R, D>;

    /// A = ∂P/∂F.
    fn tangent<R: Real>(
        &self,
        strain: &Self::Strain<R>,
        volumetric: Volumetric<R>,
    ) -> Tangent<R, D>;

    /// ∂Ṗ/∂F along V and ṗ.
    fn tangent_rate<R: Real>(
        &self,
        strain: &Self::Strain<R>,
        v: Tensor<R, D>,
        volumetric: Volumetric<R>,
    ) -> Tangent<R, D>;

    /// m ∂N/∂F.
    fn volume_tangent<R: Real>(&self, strain: &Self::Strain<R>, m: R) -> Tangent<R, D>;
}

/// An isotropic law in plane strain, by its potential of two invariants.
pub(crate) struct Plane<W>(pub(crate) W);

/// Evaluates an expression with `$law` bound to the law of a plane body.
macro_rules! with_plane_law {
    ($any:expr, $law:ident => $body:expr) => {
        $crate::material::with_potential!($any, w => {
            let $law = $crate::constitutive::Plane(w);
            $body
        }, else => unimplemented!("fibres in the plane"))
    };
}
pub(crate) use with_plane_law;

/// The entries in their places.
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
    const FINITE: bool = W::FINITE;

    type Strain<R: Real> = Strain<R>;

    #[inline(always)]
    fn strain<R: Real>(&self, h: Tensor<R, 2>, factor: Option<R>) -> Strain<R> {
        let mut strain = Strain::new(&self.0, h);
        strain.factor = factor;
        strain
    }

    #[inline(always)]
    fn dilation<R: Real>(&self, strain: &Strain<R>) -> R {
        strain.d
    }

    #[inline(always)]
    fn normal<R: Real>(&self, strain: &Strain<R>) -> Tensor<R, 2> {
        strain.normal
    }

    #[inline(always)]
    fn normal_rate<R: Real>(&self, _: &Strain<R>, v: Tensor<R, 2>) -> Tensor<R, 2> {
        volume_gradient_rate(&self.0, v)
    }

    #[inline(always)]
    fn dilation_rate<R: Real>(&self, strain: &Strain<R>, v: Tensor<R, 2>) -> R {
        strain.dilation_rate(v)
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain<R>, volumetric: Volumetric<R>) -> Tensor<R, 2> {
        strain.stress(&self.0, volumetric)
    }

    #[inline(always)]
    fn stress_rate<R: Real>(
        &self,
        strain: &Strain<R>,
        v: Tensor<R, 2>,
        volumetric: Volumetric<R>,
    ) -> Tensor<R, 2> {
        strain.stress_rate(&self.0, v, volumetric)
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain<R>, volumetric: Volumetric<R>) -> Tangent<R, 2> {
        unfold(strain.tangent(&self.0, volumetric))
    }

    #[inline(always)]
    fn tangent_rate<R: Real>(
        &self,
        strain: &Strain<R>,
        v: Tensor<R, 2>,
        volumetric: Volumetric<R>,
    ) -> Tangent<R, 2> {
        unfold(strain.tangent_rate(&self.0, v, volumetric))
    }

    #[inline(always)]
    fn volume_tangent<R: Real>(&self, _: &Strain<R>, m: R) -> Tangent<R, 2> {
        unfold(volume_tangent(&self.0, m))
    }
}

//! Interface between element passes and material laws in 2D and 3D.

mod embedded;
mod plane;
mod point;
mod spatial;

pub(crate) use embedded::{EmbeddedPlane, with_embedded_law};
pub(crate) use plane::{Plane, with_plane_law};
pub(crate) use spatial::{Spatial, with_spatial_law};

use pulp::Simd;

use crate::material::tensor::Volumetric;
use crate::material::three::Axes;
use crate::simd::lanes::Lanes;

/// Tensor with `D` × `D` entries.
pub(crate) type Tensor<R, const D: usize> = [[R; D]; D];

/// Symmetric derivative of a tensor with respect to a tensor. The entry `[i][k][j][l]` is the derivative of (i, j)
/// with respect to (k, l). Only the entries with i < k, and those with i = k and j ≤ l, are used.
pub(crate) type Tangent<R, const D: usize> = [[[[R; D]; D]; D]; D];

/// Interface of material laws for element passes.
///
/// Notation: H = ∇u, V = ∇v. The functions are evaluated with vector registers and inlined. If a velocity gradient
/// V is given, they return rates.
pub(crate) trait Constitutive<const D: usize> {
    /// Returns whether strains are finite (d = J − 1) or small (d = div u).
    fn is_finite(&self) -> bool;

    /// Returns whether the law depends on the fiber axes.
    fn has_fibers(&self) -> bool;

    /// Deformation at a point.
    type Strain<S: Simd>: Copy;

    /// Returns the deformation for the displacement gradient `h` and the fiber axes `axes`. The energy will be
    /// multiplied by `factor`.
    fn strain<S: Simd>(
        &self,
        h: Tensor<Lanes<S>, D>,
        axes: Axes<Lanes<S>>,
        factor: Option<Lanes<S>>,
    ) -> Self::Strain<S>;

    /// Returns d = J − 1, or div u for small strains.
    fn dilation<S: Simd>(&self, strain: &Self::Strain<S>) -> Lanes<S>;

    /// Returns the cofactor N = ∂d/∂F.
    fn cofactor<S: Simd>(&self, strain: &Self::Strain<S>) -> Tensor<Lanes<S>, D>;

    /// Returns g, the function of the volume that the pressure controls. By default, g = d.
    fn volume<S: Simd>(&self, strain: &Self::Strain<S>) -> Lanes<S>;

    /// Returns ġ = ∂g/∂F : V.
    fn volume_rate<S: Simd>(&self, strain: &Self::Strain<S>, v: Tensor<Lanes<S>, D>) -> Lanes<S>;

    /// Returns ∂g/∂F, or its rate along V.
    fn volume_gradient<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        v: Option<&Tensor<Lanes<S>, D>>,
    ) -> Tensor<Lanes<S>, D>;

    /// Returns P, or Ṗ along V and ṗ.
    fn stress<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        volumetric: Volumetric<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, D>>,
    ) -> Tensor<Lanes<S>, D>;

    /// Returns A = ∂P/∂F, or ∂Ṗ/∂F along V and ṗ.
    fn tangent<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        volumetric: Volumetric<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, D>>,
    ) -> Tangent<Lanes<S>, D>;

    /// Returns m ∂²g/∂F².
    fn volume_tangent<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        m: Lanes<S>,
    ) -> Tangent<Lanes<S>, D>;
}

/// Embeds a tensor in 3D. In 2D, the third row and the third column are zero.
#[inline(always)]
pub(crate) fn in_space<S: Simd, const D: usize>(
    t: &Tensor<Lanes<S>, D>,
    zero: Lanes<S>,
) -> Tensor<Lanes<S>, 3> {
    let mut out = [[zero; 3]; 3];
    for (out, row) in out.iter_mut().zip(t) {
        out[..D].copy_from_slice(row);
    }
    out
}

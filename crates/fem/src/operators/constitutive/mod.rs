//! What the element loops ask of a law at a point, in either dimension.

mod plane;
mod point;
mod sheet;
mod spatial;

pub(crate) use plane::{Plane, with_plane_law};
pub(crate) use sheet::{Sheet, with_sheet_law};
pub(crate) use spatial::{Spatial, with_spatial_law};

use pulp::Simd;

use crate::material::tensor::Volumetric;
use crate::material::three::Axes;
use crate::simd::lanes::Lanes;

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
    fn is_finite(&self) -> bool;

    /// Whether the law depends on the axes of fibres.
    fn has_fibres(&self) -> bool;

    /// The deformation at a point.
    type Strain<S: Simd>: Copy;

    /// The deformation for `h`, the law's energy multiplied by `factor`; `axes` are those of the
    /// fibres.
    fn strain<S: Simd>(
        &self,
        h: Tensor<Lanes<S>, D>,
        axes: Axes<Lanes<S>>,
        factor: Option<Lanes<S>>,
    ) -> Self::Strain<S>;

    /// d.
    fn dilation<S: Simd>(&self, strain: &Self::Strain<S>) -> Lanes<S>;

    /// N = ∂d/∂F.
    fn normal<S: Simd>(&self, strain: &Self::Strain<S>) -> Tensor<Lanes<S>, D>;

    /// Ṅ along V.
    fn normal_rate<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        v: Tensor<Lanes<S>, D>,
    ) -> Tensor<Lanes<S>, D>;

    /// ḋ = N : V.
    fn dilation_rate<S: Simd>(&self, strain: &Self::Strain<S>, v: Tensor<Lanes<S>, D>) -> Lanes<S>;

    /// P.
    fn stress<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tensor<Lanes<S>, D>;

    /// Ṗ along V and ṗ.
    fn stress_rate<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        v: Tensor<Lanes<S>, D>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tensor<Lanes<S>, D>;

    /// A = ∂P/∂F.
    fn tangent<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tangent<Lanes<S>, D>;

    /// ∂Ṗ/∂F along V and ṗ.
    fn tangent_rate<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        v: Tensor<Lanes<S>, D>,
        volumetric: Volumetric<Lanes<S>>,
    ) -> Tangent<Lanes<S>, D>;

    /// m ∂N/∂F.
    fn volume_tangent<S: Simd>(
        &self,
        strain: &Self::Strain<S>,
        m: Lanes<S>,
    ) -> Tangent<Lanes<S>, D>;
}

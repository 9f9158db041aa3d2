//! Three-dimensional laws.
//!
//! The law is selected at each point, at negligible cost. The evaluations of each law are compiled as separate
//! functions. Inlining them in the element passes would multiply the code size.

use pulp::{Simd, WithSimd};

use super::{Constitutive, Tangent, Tensor};
use crate::material::tensor::{VolumeFunction, Volumetric};
use crate::material::three::{Axes, Law3, Strain3, Symmetric3, contract3};
use crate::material::{Law, MooneyRivlin, SmallStrain, with_law};
use crate::simd::lanes::{Lanes, outlined};
use crate::solid::element_material::ElementMaterial;

/// Three-dimensional law.
#[derive(Clone, Copy)]
pub(crate) struct Spatial {
    law: Law,
    volume_function: VolumeFunction,
}

/// Representative finite-strain law, for functions that depend only on the strain measure.
const FINITE: MooneyRivlin = MooneyRivlin { c10: 0.0, c01: 0.0 };
/// Representative small-strain law, for the same purpose.
const SMALL: SmallStrain = SmallStrain { shear_modulus: 0.0 };

#[inline(always)]
fn is_finite<W: Law3>(_: &W) -> bool {
    W::FINITE
}

/// Expands the packed entries with i ≤ k.
#[inline(always)]
fn unfold<S: Simd>(a: &Symmetric3<Lanes<S>>) -> Tangent<Lanes<S>, 3> {
    let mut out = [[[[a.entry(0, 0, 0, 0); 3]; 3]; 3]; 3];
    for i in 0..3 {
        for k in i..3 {
            for j in 0..3 {
                for l in 0..3 {
                    out[i][k][j][l] = a.entry(i, j, k, l);
                }
            }
        }
    }
    out
}

/// Law at a point, for the evaluation of the stress and the tangent or their rates.
struct At<'a, S: Simd, W> {
    law: W,
    strain: &'a Strain3<Lanes<S>>,
    volumetric: &'a Volumetric<Lanes<S>>,
    /// Velocity gradient ∇v if a rate is requested.
    velocity_gradient: Option<&'a Tensor<Lanes<S>, 3>>,
}

/// Evaluates P or Ṗ.
struct Stress<'a, S: Simd, W>(At<'a, S, W>);

impl<T: Simd, W: Law3> WithSimd for Stress<'_, T, W> {
    type Output = Tensor<Lanes<T>, 3>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let At { law, strain, volumetric, velocity_gradient } = self.0;
        match velocity_gradient {
            None => strain.stress(&law, *volumetric),
            Some(v) => strain.stress_rate(&law, v, *volumetric),
        }
    }
}

/// Evaluates A or Ȧ.
struct Slope<'a, S: Simd, W>(At<'a, S, W>);

impl<T: Simd, W: Law3> WithSimd for Slope<'_, T, W> {
    type Output = Symmetric3<Lanes<T>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let At { law, strain, volumetric, velocity_gradient } = self.0;
        match velocity_gradient {
            None => strain.tangent(&law, *volumetric),
            Some(v) => strain.tangent_rate(&law, v, *volumetric),
        }
    }
}

/// Evaluates W times its factor.
struct Energy<'a, S: Simd, W> {
    law: W,
    strain: &'a Strain3<Lanes<S>>,
}

impl<T: Simd, W: Law3> WithSimd for Energy<'_, T, W> {
    type Output = Lanes<T>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.strain.energy(&self.law)
    }
}

impl Spatial {
    /// Creates a law with the default [`VolumeFunction`].
    #[inline(always)]
    pub(crate) fn new(law: Law) -> Self {
        Self { law, volume_function: VolumeFunction::default() }
    }

    #[inline(always)]
    pub(crate) fn of(material: &ElementMaterial) -> Self {
        Self { law: material.law, volume_function: material.volume_function }
    }

    /// Returns W times its factor, without the pressure term.
    #[inline(always)]
    pub(crate) fn energy<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Lanes<S> {
        with_law!(
            self.law,
            law => outlined(strain.d.simd(), Energy { law, strain }),
            custom => custom.energy(strain)
        )
    }

    /// Returns A, or Ȧ if a velocity gradient is given.
    #[inline(always)]
    pub(super) fn packed_tangent<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
        velocity_gradient: Option<&Tensor<Lanes<S>, 3>>,
    ) -> Symmetric3<Lanes<S>> {
        let volumetric = &volumetric;
        with_law!(self.law, law => outlined(strain.d.simd(), Slope(At {
            law,
            strain,
            volumetric,
            velocity_gradient,
        })), custom => custom.tangent(strain, volumetric, velocity_gradient))
    }
}

impl Constitutive<3> for Spatial {
    #[inline(always)]
    fn has_fibers(&self) -> bool {
        self.law.has_fibers()
    }

    type Strain<S: Simd> = Strain3<Lanes<S>>;

    #[inline(always)]
    fn is_finite(&self) -> bool {
        with_law!(self.law, w => is_finite(&w), custom => custom.is_finite())
    }

    #[inline(always)]
    fn strain<S: Simd>(
        &self,
        h: Tensor<Lanes<S>, 3>,
        axes: Axes<Lanes<S>>,
        factor: Option<Lanes<S>>,
    ) -> Strain3<Lanes<S>> {
        let mut strain = match self.is_finite() {
            true => Strain3::new(&FINITE, h, axes),
            false => Strain3::new(&SMALL, h, axes),
        };
        strain.factor = factor;
        strain.volume_function = self.volume_function;
        strain
    }

    #[inline(always)]
    fn dilation<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Lanes<S> {
        strain.d
    }

    #[inline(always)]
    fn cofactor<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Tensor<Lanes<S>, 3> {
        strain.cofactor
    }

    #[inline(always)]
    fn volume<S: Simd>(&self, strain: &Strain3<Lanes<S>>) -> Lanes<S> {
        strain.volume()
    }

    #[inline(always)]
    fn volume_rate<S: Simd>(&self, strain: &Strain3<Lanes<S>>, v: Tensor<Lanes<S>, 3>) -> Lanes<S> {
        contract3(&strain.volume_gradient(), &v)
    }

    #[inline(always)]
    fn volume_gradient<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 3>>,
    ) -> Tensor<Lanes<S>, 3> {
        match v {
            None => strain.volume_gradient(),
            Some(v) if self.is_finite() => strain.volume_gradient_rate(&FINITE, v),
            Some(v) => strain.volume_gradient_rate(&SMALL, v),
        }
    }

    #[inline(always)]
    fn stress<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
        velocity_gradient: Option<&Tensor<Lanes<S>, 3>>,
    ) -> Tensor<Lanes<S>, 3> {
        let volumetric = &volumetric;
        with_law!(self.law, law => outlined(strain.d.simd(), Stress(At {
            law,
            strain,
            volumetric,
            velocity_gradient,
        })), custom => custom.stress(strain, volumetric, velocity_gradient))
    }

    #[inline(always)]
    fn tangent<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        volumetric: Volumetric<Lanes<S>>,
        v: Option<&Tensor<Lanes<S>, 3>>,
    ) -> Tangent<Lanes<S>, 3> {
        unfold(&self.packed_tangent(strain, volumetric, v))
    }

    #[inline(always)]
    fn volume_tangent<S: Simd>(
        &self,
        strain: &Strain3<Lanes<S>>,
        m: Lanes<S>,
    ) -> Tangent<Lanes<S>, 3> {
        match self.is_finite() {
            true => unfold(&strain.volume_tangent(&FINITE, m)),
            false => unfold(&strain.volume_tangent(&SMALL, m)),
        }
    }
}

/// Evaluates an expression with `$law` bound to the law of a 3D body.
macro_rules! with_spatial_law {
    ($material:expr, $law:ident => $body:expr) => {{
        let $law = $crate::operators::constitutive::Spatial::of($material);
        $body
    }};
}
pub(crate) use with_spatial_law;

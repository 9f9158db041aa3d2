//! User-defined laws.
//!
//! A [`Law3`] is generic over its number type, and generic functions cannot be called through a trait object.
//! Therefore every law also implements the object-safe trait [`DynLaw`]. Its functions evaluate blocks of points,
//! which are passed as arrays, with the vector instructions of the processor. The results are bitwise equal to the
//! results of a built-in law in 3D. The overhead consists of one call and the conversion to arrays.

use std::fmt;

use pulp::{Arch, Simd, WithSimd};

use super::super::Real;
use super::super::parameters::Description;
use super::super::tensor::{VolumeFunction, Volumetric};
use super::law::Law3;
use super::strain::{Axes, Strain3};
use super::tensor::{Symmetric3, Tensor3Of};
use crate::simd::lanes::{Array, Lanes};

/// Reference to a user-defined law, created by [`Law::custom`](crate::Law::custom).
#[derive(Clone, Copy)]
pub struct CustomLaw {
    name: &'static str,
    law: &'static dyn DynLaw,
    /// Factor of the energy.
    factor: f64,
}

impl CustomLaw {
    pub(crate) fn new<W: Law3 + Send + Sync>(name: &'static str, law: &'static W) -> Self {
        let factor = 1.0;
        Self { name, law, factor }
    }

    /// Returns the law with its energy multiplied by `factor`.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { factor: self.factor * factor, ..self }
    }

    /// Returns a description without constants, because these are private to the law.
    pub(crate) fn description(self) -> Description {
        Description {
            name: self.name,
            energy: "",
            about: "",
            parameters: &[],
            complete: self.law.is_complete(),
        }
    }

    pub(crate) fn has_fibers(self) -> bool {
        self.law.has_fibers()
    }

    pub(crate) fn is_finite(self) -> bool {
        self.law.is_finite()
    }

    /// Returns W times the factor.
    #[inline(never)]
    pub(crate) fn energy<R: SimdReal>(self, strain: &Strain3<R>) -> R {
        let none = Volumetric::pressure(strain.d.like(0.0));
        let found = self.law.energy(&self.block(strain, &none, None));
        strain.d.first_lanes(&found)
    }

    /// Returns P, or Ṗ if a velocity gradient is given.
    #[inline(never)]
    pub(crate) fn stress<R: SimdReal>(
        self,
        strain: &Strain3<R>,
        volumetric: &Volumetric<R>,
        velocity_gradient: Option<&Tensor3Of<R>>,
    ) -> Tensor3Of<R> {
        let found = self.law.stress(&self.block(strain, volumetric, velocity_gradient));
        found.map(|row| row.map(|entry| strain.d.first_lanes(&entry)))
    }

    /// Returns A, or Ȧ if a velocity gradient is given.
    #[inline(never)]
    pub(crate) fn tangent<R: SimdReal>(
        self,
        strain: &Strain3<R>,
        volumetric: &Volumetric<R>,
        velocity_gradient: Option<&Tensor3Of<R>>,
    ) -> Symmetric3<R> {
        let found = self.law.tangent(&self.block(strain, volumetric, velocity_gradient));
        Symmetric3(found.0.map(|entry| strain.d.first_lanes(&entry)))
    }

    fn block<R: SimdReal>(
        self,
        strain: &Strain3<R>,
        volumetric: &Volumetric<R>,
        velocity_gradient: Option<&Tensor3Of<R>>,
    ) -> PointBlock {
        let tensor = |t: &Tensor3Of<R>| t.map(|row| row.map(SimdReal::to_array));
        let factor = match (strain.factor, self.factor) {
            (factor, 1.0) => factor,
            (None, factor) => Some(strain.d.like(factor)),
            (Some(strain_factor), factor) => Some(strain_factor * factor),
        };
        PointBlock {
            count: R::COUNT,
            h: tensor(&strain.h),
            axes: Axes {
                fiber: strain.axes.fiber.map(SimdReal::to_array),
                sheet: strain.axes.sheet.map(SimdReal::to_array),
            },
            factor: factor.map(SimdReal::to_array),
            volume_function: strain.volume_function,
            volumetric: Volumetric {
                p: volumetric.p.to_array(),
                p_rate: volumetric.p_rate.to_array(),
                kappa: volumetric.kappa,
            },
            velocity_gradient: velocity_gradient.map(tensor),
        }
    }
}

impl fmt::Debug for CustomLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Compares addresses and factors. A false negative only splits a batch of elements in two.
impl PartialEq for CustomLaw {
    #[allow(ambiguous_wide_pointer_comparisons)]
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.law, other.law) && self.factor == other.factor
    }
}

/// Number type that can be stored in a block.
pub(crate) trait SimdReal: Real {
    const COUNT: usize;

    /// Returns an array that starts with these values.
    fn to_array(self) -> Array;

    /// Returns the first values of an array as a number of the type of `self`.
    fn first_lanes(self, array: &Array) -> Self;
}

impl SimdReal for f64 {
    const COUNT: usize = 1;

    fn to_array(self) -> Array {
        let mut array = Array::ZERO;
        array.0[0] = self;
        array
    }

    fn first_lanes(self, array: &Array) -> Self {
        array.0[0]
    }
}

impl<S: Simd> SimdReal for Lanes<S> {
    const COUNT: usize = S::F64_LANES;

    fn to_array(self) -> Array {
        let mut array = Array::ZERO;
        self.store(&mut array, 0);
        array
    }

    fn first_lanes(self, array: &Array) -> Self {
        Lanes::load(self.simd(), array, 0)
    }
}

/// Block of points. The arguments of a law are stored in arrays.
struct PointBlock {
    count: usize,
    h: Tensor3Of<Array>,
    axes: Axes<Array>,
    factor: Option<Array>,
    volume_function: VolumeFunction,
    volumetric: Volumetric<Array>,
    /// Velocity gradient ∇v if a rate is requested.
    velocity_gradient: Option<Tensor3Of<Array>>,
}

/// Object-safe interface of a law.
trait DynLaw: Send + Sync {
    fn is_finite(&self) -> bool;
    fn is_complete(&self) -> bool;
    fn has_fibers(&self) -> bool;
    fn energy(&self, block: &PointBlock) -> Array;
    fn stress(&self, block: &PointBlock) -> Tensor3Of<Array>;
    fn tangent(&self, block: &PointBlock) -> Symmetric3<Array>;
}

impl<W: Law3 + Send + Sync> DynLaw for W {
    fn is_finite(&self) -> bool {
        W::FINITE
    }

    fn is_complete(&self) -> bool {
        W::COMPLETE
    }

    fn has_fibers(&self) -> bool {
        W::FIBERS
    }

    fn energy(&self, block: &PointBlock) -> Array {
        Arch::new().dispatch(Energy { law: self, block })
    }

    fn stress(&self, block: &PointBlock) -> Tensor3Of<Array> {
        Arch::new().dispatch(Stress { law: self, block })
    }

    fn tangent(&self, block: &PointBlock) -> Symmetric3<Array> {
        Arch::new().dispatch(Tangent { law: self, block })
    }
}

/// The points of a block that fit in one register.
struct Part<S: Simd> {
    strain: Strain3<Lanes<S>>,
    volumetric: Volumetric<Lanes<S>>,
    velocity_gradient: Option<Tensor3Of<Lanes<S>>>,
}

impl PointBlock {
    #[inline(always)]
    fn n_parts<S: Simd>(&self, _: S) -> usize {
        self.count.div_ceil(S::F64_LANES)
    }

    #[inline(always)]
    fn part<S: Simd, W: Law3>(&self, simd: S, law: &W, part: usize) -> Part<S> {
        let mut axes = Axes::cartesian(Lanes::zero(simd));
        for i in 0..3 {
            axes.fiber[i] = Lanes::load(simd, &self.axes.fiber[i], part);
            axes.sheet[i] = Lanes::load(simd, &self.axes.sheet[i], part);
        }
        let mut strain = Strain3::new(law, loaded(simd, &self.h, part), axes);
        strain.volume_function = self.volume_function;
        if let Some(factor) = &self.factor {
            strain.factor = Some(Lanes::load(simd, factor, part));
        }
        #[allow(clippy::manual_map)] // closures would be compiled without vector instructions
        let velocity_gradient = match &self.velocity_gradient {
            Some(velocity_gradient) => Some(loaded(simd, velocity_gradient, part)),
            None => None,
        };
        Part {
            strain,
            volumetric: Volumetric {
                p: Lanes::load(simd, &self.volumetric.p, part),
                p_rate: Lanes::load(simd, &self.volumetric.p_rate, part),
                kappa: self.volumetric.kappa,
            },
            velocity_gradient,
        }
    }
}

#[inline(always)]
fn loaded<S: Simd>(simd: S, arrays: &Tensor3Of<Array>, part: usize) -> Tensor3Of<Lanes<S>> {
    let mut out = [[Lanes::zero(simd); 3]; 3];
    for (row, arrays) in out.iter_mut().zip(arrays) {
        for (entry, array) in row.iter_mut().zip(arrays) {
            *entry = Lanes::load(simd, array, part);
        }
    }
    out
}

/// Evaluates W for a block.
struct Energy<'a, W> {
    law: &'a W,
    block: &'a PointBlock,
}

impl<W: Law3> WithSimd for Energy<'_, W> {
    type Output = Array;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, block } = self;
        let mut out = Array::ZERO;
        for number in 0..block.n_parts(simd) {
            let part = block.part(simd, law, number);
            part.strain.energy(law).store(&mut out, number);
        }
        out
    }
}

/// Evaluates P or Ṗ for a block.
struct Stress<'a, W> {
    law: &'a W,
    block: &'a PointBlock,
}

impl<W: Law3> WithSimd for Stress<'_, W> {
    type Output = Tensor3Of<Array>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, block } = self;
        let mut out = [[Array::ZERO; 3]; 3];
        for number in 0..block.n_parts(simd) {
            let part = block.part(simd, law, number);
            let stress = match &part.velocity_gradient {
                None => part.strain.stress(law, part.volumetric),
                Some(v) => part.strain.stress_rate(law, v, part.volumetric),
            };
            for (out, stress) in out.iter_mut().flatten().zip(stress.iter().flatten()) {
                stress.store(out, number);
            }
        }
        out
    }
}

/// Evaluates A or Ȧ for a block.
struct Tangent<'a, W> {
    law: &'a W,
    block: &'a PointBlock,
}

impl<W: Law3> WithSimd for Tangent<'_, W> {
    type Output = Symmetric3<Array>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, block } = self;
        let mut out = Symmetric3([Array::ZERO; 45]);
        for number in 0..block.n_parts(simd) {
            let part = block.part(simd, law, number);
            let tangent = match &part.velocity_gradient {
                None => part.strain.tangent(law, part.volumetric),
                Some(v) => part.strain.tangent_rate(law, v, part.volumetric),
            };
            for (out, tangent) in out.0.iter_mut().zip(&tangent.0) {
                tangent.store(out, number);
            }
        }
        out
    }
}

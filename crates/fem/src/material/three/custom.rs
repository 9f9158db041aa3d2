//! Laws that are not of the crate's list, in a body.
//!
//! A [`Law3`] is generic over its numbers, and functions that are generic cannot be called by
//! reference. Over blocks of points they can: every law is [`Blockwise`], takes what it is asked at as
//! arrays, and computes with the vector instructions of the processor. The numbers are those of a law
//! of the list in space, to the last bit. It costs a call and the way through the arrays.

use std::fmt;

use pulp::{Arch, Simd, WithSimd};

use super::super::Real;
use super::super::parameters::Description;
use super::super::tensor::Volumetric;
use super::law::Law3;
use super::strain::{Axes, Strain3};
use super::tensor::{Symmetric3, Tensor3Of};
use crate::simd::lanes::{Array, Lanes};

/// A law written outside the crate, by reference; made by [`Law::custom`](crate::Law::custom).
#[derive(Clone, Copy)]
pub struct CustomLaw {
    name: &'static str,
    law: &'static dyn Blockwise,
    /// Of the energy.
    factor: f64,
}

impl CustomLaw {
    pub(crate) fn new<W: Law3 + Send + Sync>(name: &'static str, law: &'static W) -> Self {
        let factor = 1.0;
        Self { name, law, factor }
    }

    /// The law with its energy multiplied by `factor`.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self {
            factor: self.factor * factor,
            ..self
        }
    }

    /// A description without constants, which the law keeps to itself.
    pub(crate) fn description(self) -> Description {
        Description {
            name: self.name,
            energy: "",
            about: "",
            parameters: &[],
            fibres: self.law.has_fibres(),
            complete: self.law.is_complete(),
        }
    }

    pub(crate) fn has_fibres(self) -> bool {
        self.law.has_fibres()
    }

    pub(crate) fn is_finite(self) -> bool {
        self.law.is_finite()
    }

    /// W, times the factor.
    #[inline(never)]
    pub(crate) fn energy<R: Few>(self, strain: &Strain3<R>) -> R {
        let none = Volumetric::pressure(strain.d.like(0.0));
        let found = self.law.energy(&self.block(strain, &none, None));
        strain.d.first_of(&found)
    }

    /// P, or Ṗ `along` a motion.
    #[inline(never)]
    pub(crate) fn stress<R: Few>(
        self,
        strain: &Strain3<R>,
        volumetric: &Volumetric<R>,
        along: Option<&Tensor3Of<R>>,
    ) -> Tensor3Of<R> {
        let found = self.law.stress(&self.block(strain, volumetric, along));
        found.map(|row| row.map(|entry| strain.d.first_of(&entry)))
    }

    /// A, or Ȧ `along` a motion.
    #[inline(never)]
    pub(crate) fn tangent<R: Few>(
        self,
        strain: &Strain3<R>,
        volumetric: &Volumetric<R>,
        along: Option<&Tensor3Of<R>>,
    ) -> Symmetric3<R> {
        let found = self.law.tangent(&self.block(strain, volumetric, along));
        Symmetric3(found.0.map(|entry| strain.d.first_of(&entry)))
    }

    fn block<R: Few>(
        self,
        strain: &Strain3<R>,
        volumetric: &Volumetric<R>,
        along: Option<&Tensor3Of<R>>,
    ) -> Block {
        let tensor = |t: &Tensor3Of<R>| t.map(|row| row.map(Few::spread));
        let factor = match (strain.factor, self.factor) {
            (factor, 1.0) => factor,
            (None, factor) => Some(strain.d.like(factor)),
            (Some(of_strain), factor) => Some(of_strain * factor),
        };
        Block {
            count: R::COUNT,
            h: tensor(&strain.h),
            axes: Axes {
                fibre: strain.axes.fibre.map(Few::spread),
                sheet: strain.axes.sheet.map(Few::spread),
            },
            factor: factor.map(Few::spread),
            volumetric: Volumetric {
                p: volumetric.p.spread(),
                p_rate: volumetric.p_rate.spread(),
                kappa: volumetric.kappa,
            },
            along: along.map(tensor),
        }
    }
}

impl fmt::Debug for CustomLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// The same law at the same place. One that is taken for two costs a batch of elements, no more.
impl PartialEq for CustomLaw {
    #[allow(ambiguous_wide_pointer_comparisons)]
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.law, other.law) && self.factor == other.factor
    }
}

/// Numbers of a block.
pub(crate) trait Few: Real {
    /// How many there are.
    const COUNT: usize;

    /// An array that begins with them.
    fn spread(self) -> Array;

    /// The numbers that an array begins with, in the kind of `self`.
    fn first_of(self, array: &Array) -> Self;
}

impl Few for f64 {
    const COUNT: usize = 1;

    fn spread(self) -> Array {
        let mut array = Array::ZERO;
        array.0[0] = self;
        array
    }

    fn first_of(self, array: &Array) -> Self {
        array.0[0]
    }
}

impl<S: Simd> Few for Lanes<S> {
    const COUNT: usize = S::F64_LANES;

    fn spread(self) -> Array {
        let mut array = Array::ZERO;
        self.store(&mut array, 0);
        array
    }

    fn first_of(self, array: &Array) -> Self {
        Lanes::load(self.simd(), array, 0)
    }
}

/// Some points: what a law is asked at, each number for all of them in an array.
struct Block {
    /// How many points.
    count: usize,
    h: Tensor3Of<Array>,
    axes: Axes<Array>,
    factor: Option<Array>,
    volumetric: Volumetric<Array>,
    /// ∇v, where the rate is wanted.
    along: Option<Tensor3Of<Array>>,
}

/// A law, as functions that an object can have.
trait Blockwise: Send + Sync {
    fn is_finite(&self) -> bool;
    fn is_complete(&self) -> bool;
    fn has_fibres(&self) -> bool;
    fn energy(&self, block: &Block) -> Array;
    fn stress(&self, block: &Block) -> Tensor3Of<Array>;
    fn tangent(&self, block: &Block) -> Symmetric3<Array>;
}

impl<W: Law3 + Send + Sync> Blockwise for W {
    fn is_finite(&self) -> bool {
        W::FINITE
    }

    fn is_complete(&self) -> bool {
        W::COMPLETE
    }

    fn has_fibres(&self) -> bool {
        W::FIBRES
    }

    fn energy(&self, block: &Block) -> Array {
        Arch::new().dispatch(Energy { law: self, block })
    }

    fn stress(&self, block: &Block) -> Tensor3Of<Array> {
        Arch::new().dispatch(Stress { law: self, block })
    }

    fn tangent(&self, block: &Block) -> Symmetric3<Array> {
        Arch::new().dispatch(Tangent { law: self, block })
    }
}

/// Part of the points of a block, as many as a register holds.
struct Part<S: Simd> {
    strain: Strain3<Lanes<S>>,
    volumetric: Volumetric<Lanes<S>>,
    along: Option<Tensor3Of<Lanes<S>>>,
}

impl Block {
    #[inline(always)]
    fn n_parts<S: Simd>(&self, _: S) -> usize {
        self.count.div_ceil(S::F64_LANES)
    }

    #[inline(always)]
    fn part<S: Simd, W: Law3>(&self, simd: S, law: &W, part: usize) -> Part<S> {
        let mut axes = Axes::cartesian(Lanes::zero(simd));
        for i in 0..3 {
            axes.fibre[i] = Lanes::load(simd, &self.axes.fibre[i], part);
            axes.sheet[i] = Lanes::load(simd, &self.axes.sheet[i], part);
        }
        let mut strain = Strain3::new(law, loaded(simd, &self.h, part), axes);
        if let Some(factor) = &self.factor {
            strain.factor = Some(Lanes::load(simd, factor, part));
        }
        #[allow(clippy::manual_map)] // a closure is compiled without the instructions it calls
        let along = match &self.along {
            Some(along) => Some(loaded(simd, along, part)),
            None => None,
        };
        Part {
            strain,
            volumetric: Volumetric {
                p: Lanes::load(simd, &self.volumetric.p, part),
                p_rate: Lanes::load(simd, &self.volumetric.p_rate, part),
                kappa: self.volumetric.kappa,
            },
            along,
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

/// W of a block.
struct Energy<'a, W> {
    law: &'a W,
    block: &'a Block,
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

/// P or Ṗ of a block.
struct Stress<'a, W> {
    law: &'a W,
    block: &'a Block,
}

impl<W: Law3> WithSimd for Stress<'_, W> {
    type Output = Tensor3Of<Array>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, block } = self;
        let mut out = [[Array::ZERO; 3]; 3];
        for number in 0..block.n_parts(simd) {
            let part = block.part(simd, law, number);
            let stress = match &part.along {
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

/// A or Ȧ of a block.
struct Tangent<'a, W> {
    law: &'a W,
    block: &'a Block,
}

impl<W: Law3> WithSimd for Tangent<'_, W> {
    type Output = Symmetric3<Array>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, block } = self;
        let mut out = Symmetric3([Array::ZERO; 45]);
        for number in 0..block.n_parts(simd) {
            let part = block.part(simd, law, number);
            let tangent = match &part.along {
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

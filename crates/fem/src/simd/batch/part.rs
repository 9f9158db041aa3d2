//! Elements of a batch that fit in a register, with their data and fields at quadrature points.

use std::ops::Range;

use pulp::Simd;

use super::{Batch, Point, dot};
use crate::material::three::Axes;
use crate::material::{Law, Real};
use crate::operators::fields::Inverted;
use crate::simd::lanes::Lanes;
use crate::solid::element_material::ElementScale;

/// Elements of a batch that fit in a register.
pub(crate) struct Part<'a, S: Simd, const D: usize, const N: usize, const P: usize> {
    simd: S,
    pub(crate) batch: &'a Batch<D, N, P>,
    number: usize,
    /// Lanes of the batch, including unused lanes.
    pub(super) lanes: Range<usize>,
    /// Whether vectors are stored element by element; see [`BatchRange`](super::BatchRange).
    pub(super) element_wise: bool,
    inverse: [[Lanes<S>; D]; D],
    measure: Lanes<S>,
}

impl<const D: usize, const N: usize, const P: usize> Batch<D, N, P> {
    /// Returns the number of nonempty parts.
    #[inline(always)]
    pub(crate) fn n_parts<S: Simd>(&self, _: S) -> usize {
        self.count.div_ceil(S::F64_LANES)
    }

    #[inline(always)]
    pub(crate) fn part<S: Simd>(&self, simd: S, part: usize) -> Part<'_, S, D, N, P> {
        let (inverse, measure) = self.geometry[0].load(simd, part);
        Part {
            simd,
            batch: self,
            number: part,
            lanes: part * S::F64_LANES..(part + 1) * S::F64_LANES,
            element_wise: false,
            inverse,
            measure,
        }
    }
}

impl<S: Simd, const D: usize, const N: usize, const P: usize> Part<'_, S, D, N, P> {
    /// Selects whether vectors are stored element by element.
    #[inline(always)]
    pub(crate) fn element_wise(mut self, element_wise: bool) -> Self {
        self.element_wise = element_wise;
        self
    }

    /// Loads the map of curved elements at a quadrature point. The map of straight elements is constant.
    #[inline(always)]
    pub(crate) fn move_to(&mut self, point: usize) {
        if self.batch.geometry.len() > 1 {
            (self.inverse, self.measure) = self.batch.geometry[point].load(self.simd, self.number);
        }
    }

    #[inline(always)]
    pub(crate) fn zero(&self) -> Lanes<S> {
        Lanes::zero(self.simd)
    }

    /// Returns the fiber axes at a point, or the coordinate axes if fiber axes are not `needed`.
    #[inline(always)]
    pub(crate) fn axes(&self, point: usize, needed: bool) -> Axes<Lanes<S>> {
        let mut axes = Axes::cartesian(self.zero());
        if needed && let Some([fiber, sheet]) = self.batch.axes.get(point) {
            for i in 0..3 {
                axes.fiber[i] = Lanes::load(self.simd, &fiber[i], self.number);
                axes.sheet[i] = Lanes::load(self.simd, &sheet[i], self.number);
            }
        }
        axes
    }

    #[inline(always)]
    pub(crate) fn law(&self) -> Law {
        self.batch.material.law
    }

    #[inline(always)]
    pub(crate) fn scale(&self) -> ElementScale {
        self.batch.material.scale
    }

    pub(crate) fn element(&self, lane: usize) -> usize {
        self.batch.elements[self.lanes.start + lane]
    }

    /// Returns the used lanes of the batch.
    #[inline(always)]
    pub(crate) fn occupied(&self) -> Range<usize> {
        self.lanes.start..self.lanes.end.min(self.batch.count)
    }

    /// Returns ∇u at a quadrature point, which is the reference gradient times the inverse map.
    #[inline(always)]
    pub(crate) fn gradient(
        &self,
        u: &[[Lanes<S>; D]; N],
        point: &Point<D, N, P>,
    ) -> [[Lanes<S>; D]; D] {
        let mut h = [[self.zero(); D]; D];
        for (i, row) in h.iter_mut().enumerate() {
            let mut reference = [self.zero(); D];
            for (value, gradient) in u.iter().zip(&point.gradients) {
                for (sum, &gradient) in reference.iter_mut().zip(gradient) {
                    *sum = value[i].mul_add(sum.like(gradient), *sum);
                }
            }
            for (j, entry) in row.iter_mut().enumerate() {
                let mut column = reference;
                for (entry, inverse) in column.iter_mut().zip(&self.inverse) {
                    *entry = inverse[j];
                }
                *entry = dot(&reference, &column);
            }
        }
        h
    }

    /// Interpolates a pressure-like field to a quadrature point.
    #[inline(always)]
    pub(crate) fn interpolate(&self, p: &[Lanes<S>; P], point: &Point<D, N, P>) -> Lanes<S> {
        let mut sum = p[0] * point.psi[0];
        for i in 1..P {
            sum = sum + p[i] * point.psi[i];
        }
        sum
    }

    /// Interpolates the energy's factors to a quadrature point, if there are any.
    #[inline(always)]
    pub(crate) fn interpolate_factors(
        &self,
        factors: &Option<[Lanes<S>; P]>,
        point: &Point<D, N, P>,
    ) -> Option<Lanes<S>> {
        Some(self.interpolate(factors.as_ref()?, point))
    }

    #[inline(always)]
    pub(crate) fn fiber(&self, point: usize) -> [Lanes<S>; D] {
        let axes = self.axes(point, true);
        let mut fiber = [self.zero(); D];
        for (fiber, along) in fiber.iter_mut().zip(axes.fiber) {
            *fiber = along;
        }
        fiber
    }

    /// Returns the gradients of the shape functions at a point, which are the reference gradients times the
    /// inverse map.
    #[inline(always)]
    pub(crate) fn gradients(&self, point: &Point<D, N, P>) -> [[Lanes<S>; D]; N] {
        let mut gradients = [[self.zero(); D]; N];
        for (gradient, reference) in gradients.iter_mut().zip(&point.gradients) {
            for (j, entry) in gradient.iter_mut().enumerate() {
                for (slope, inverse) in reference.iter().zip(&self.inverse) {
                    *entry = inverse[j].mul_add(entry.like(*slope), *entry);
                }
            }
        }
        gradients
    }

    /// Returns ∂ξ/∂x.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> &[[Lanes<S>; D]; D] {
        &self.inverse
    }

    /// Returns w T J⁻ᵀ with the quadrature weight w, which can be contracted with reference gradients.
    #[inline(always)]
    pub(crate) fn pull_back(
        &self,
        point: &Point<D, N, P>,
        tensor: &[[Lanes<S>; D]; D],
    ) -> [[Lanes<S>; D]; D] {
        let weights = self.weights(point);
        let mut out = [[self.zero(); D]; D];
        for (row, tensor) in out.iter_mut().zip(tensor) {
            for (entry, inverse) in row.iter_mut().zip(&self.inverse) {
                *entry = weights * dot(tensor, inverse);
            }
        }
        out
    }

    /// Returns an error if an element is inverted at a point. `d` is det F − 1.
    #[inline(always)]
    pub(crate) fn expect_not_inverted(
        &self,
        point: &Point<D, N, P>,
        d: Lanes<S>,
    ) -> Result<(), Inverted> {
        let inverted = |d: &f64| *d <= -1.0 || d.is_nan();
        match d.as_slice().iter().position(inverted) {
            Some(lane) => {
                let jacobian = 1.0 + d.as_slice()[lane];
                Err(Inverted::new(self.element(lane), &point.psi, jacobian))
            }
            None => Ok(()),
        }
    }

    #[inline(always)]
    pub(crate) fn weights(&self, point: &Point<D, N, P>) -> Lanes<S> {
        self.measure * point.weight
    }
}

//! Maps from the reference element to the elements of a batch.

use pulp::Simd;

use crate::simd::lanes::{Array, LANES, Lanes};
use crate::space::Space;

/// Map from the reference element to each element of a batch, evaluated at a point.
#[derive(Debug, Clone)]
pub(super) struct Geometry<const D: usize> {
    /// Inverse ∂ξ/∂x of the map's derivative.
    inverse: [[Array; D]; D],
    /// Local measure: det ∂x/∂ξ times the reference measure.
    measure: Array,
}

impl<const D: usize> Geometry<D> {
    /// Computes the map at a point. The measure is zero for lanes from `count` on.
    pub(super) fn new(
        space: &Space,
        elements: &[usize; LANES],
        count: usize,
        lambda: &[f64],
    ) -> Self {
        let mut inverse = [[Array::ZERO; D]; D];
        let mut measures = Array::ZERO;
        for (l, &element) in elements.iter().enumerate() {
            let (map, measure) = space.map_at::<D>(element, lambda);
            for (row, map) in inverse.iter_mut().zip(map) {
                for (entry, map) in row.iter_mut().zip(map) {
                    entry.0[l] = map;
                }
            }
            if l < count {
                measures.0[l] = measure;
            }
        }
        Self { inverse, measure: measures }
    }

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S, part: usize) -> ([[Lanes<S>; D]; D], Lanes<S>) {
        let mut inverse = [[Lanes::zero(simd); D]; D];
        for (row, arrays) in inverse.iter_mut().zip(&self.inverse) {
            for (entry, array) in row.iter_mut().zip(arrays) {
                *entry = Lanes::load(simd, array, part);
            }
        }
        (inverse, Lanes::load(simd, &self.measure, part))
    }
}

//! Driver of the element passes. It selects the law of each batch and runs a kernel on the elements of the batch.

use pulp::{Simd, WithSimd};

use crate::operators::constitutive::{
    Constitutive, with_embedded_law, with_plane_law, with_spatial_law,
};
use crate::operators::fields::Inverted;
use crate::simd::batch::{BatchRange, Part, Point};
use crate::simd::lanes::outlined;

/// Contribution of elements to the results of a pass.
pub(crate) trait Kernel<const D: usize, const N: usize, const P: usize> {
    /// Whether a second kernel without rates is compiled in 2D. In 3D, one kernel is sufficient, because the test at
    /// run time costs little.
    const SPLIT: bool = false;

    /// Buffers that all parts share.
    type Workspace<S: Simd>: Default;

    /// Sets the results to zero.
    fn clear(&mut self) {}

    /// Returns whether a requested result depends on v, ṗ or μ.
    fn has_rates(&self) -> bool {
        true
    }

    /// Adds the contribution of a part of the batch with index `batch`. `RATES` is false only if
    /// no result [has rates](Self::has_rates).
    fn part<S: Simd, C: Constitutive<D>, const RATES: bool>(
        &mut self,
        law: &C,
        part: &mut Part<'_, S, D, N, P>,
        points: &[Point<D, N, P>],
        batch: usize,
        workspace: &mut Self::Workspace<S>,
    ) -> Result<(), Inverted>;
}

/// Pass of a kernel over batches.
pub(crate) struct ElementPass<'a, K, const D: usize, const N: usize, const P: usize> {
    pub(crate) elements: BatchRange<'a, D, N, P>,
    pub(crate) kernel: K,
}

/// Pass over batches of one law, compiled as a separate function.
struct Run<'a, C, K, const D: usize, const N: usize, const P: usize, const RATES: bool> {
    law: C,
    elements: BatchRange<'a, D, N, P>,
    /// Index of the first batch.
    first: usize,
    kernel: &'a mut K,
}

impl<C, K, const D: usize, const N: usize, const P: usize, const RATES: bool> WithSimd
    for Run<'_, C, K, D, N, P, RATES>
where
    C: Constitutive<D>,
    K: Kernel<D, N, P>,
{
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let BatchRange { points, batches, element_wise } = self.elements;
        let mut workspace = K::Workspace::<S>::default();
        for (index, batch) in batches.iter().enumerate() {
            for part in 0..batch.n_parts(simd) {
                let part = &mut batch.part(simd, part).element_wise(element_wise);
                let index = self.first + index;
                self.kernel.part::<S, C, RATES>(&self.law, part, points, index, &mut workspace)?;
            }
        }
        Ok(())
    }
}

/// Implements the pass for one element type. The macro `$with_law` binds the laws of this type.
macro_rules! pass {
    ($dimension:literal, $nodes:literal, $pressures:literal, $with_law:ident) => {
        impl<K: Kernel<$dimension, $nodes, $pressures>> WithSimd
            for ElementPass<'_, K, $dimension, $nodes, $pressures>
        {
            type Output = Result<(), Inverted>;

            #[inline(always)]
            fn with_simd<S: Simd>(mut self, simd: S) -> Self::Output {
                self.kernel.clear();
                if const { $dimension == 3 || !K::SPLIT } || self.kernel.has_rates() {
                    self.run::<S, true>(simd)
                } else {
                    self.run::<S, false>(simd)
                }
            }
        }

        impl<K: Kernel<$dimension, $nodes, $pressures>>
            ElementPass<'_, K, $dimension, $nodes, $pressures>
        {
            #[inline(always)]
            fn run<S: Simd, const RATES: bool>(self, simd: S) -> Result<(), Inverted> {
                let Self { elements, mut kernel } = self;
                let mut first = 0;
                for batches in elements.batches.chunk_by(|a, b| a.material.is_computed_like(&b.material)) {
                    $with_law!(&batches[0].material, law => outlined(
                        simd,
                        Run::<_, _, $dimension, $nodes, $pressures, RATES> {
                            law,
                            elements: BatchRange { batches, ..elements },
                            first,
                            kernel: &mut kernel,
                        },
                    )?);
                    first += batches.len();
                }
                Ok(())
            }
        }
    };
}

pass!(2, 3, 3, with_embedded_law);
pass!(2, 6, 3, with_plane_law);
pass!(3, 4, 4, with_spatial_law);
pass!(3, 10, 4, with_spatial_law);

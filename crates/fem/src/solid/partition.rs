//! Partition of the elements of a solid among workers.

use std::sync::Arc;

use crate::operators::added::AddedTangents;
use crate::operators::fields::{Inverted, Tangents, Vectors};
use crate::solid::assembler::{ParallelAssembler, Pass};

use super::{Elements, MappedBatches, Solid, with_elements};

impl<const D: usize, const N: usize, const P: usize> MappedBatches<D, N, P> {
    /// Keeps partition `number` of `count`. All partitions have an equal number of batches for each law and added
    /// stress.
    fn keep_share(&mut self, number: usize, count: usize) {
        let mut kept = Vec::new();
        let batches = &self.batches.batches;
        for alike in batches.chunk_by(|a, b| {
            a.material.is_computed_like(&b.material) && a.material.added == b.material.added
        }) {
            let share = |number: usize| alike.len() * number / count;
            kept.extend((0..alike.len()).map(|k| (share(number)..share(number + 1)).contains(&k)));
        }
        let mut batch_flags = kept.iter();
        self.batches.batches.retain(|_| *batch_flags.next().unwrap_or(&false));
        let mut map_flags = kept.iter();
        self.maps.retain(|_| *map_flags.next().unwrap_or(&false));
    }
}

/// Local partition of the elements.
#[derive(Debug, Clone)]
pub(super) struct Partition {
    elements: Elements,
    /// Workers that compute the other partitions. Without workers, results are partial sums.
    assembler: Option<Arc<dyn ParallelAssembler>>,
}

impl Solid {
    /// Returns the solid with partition `number` of `count`. The [passes](Pass) of this solid return partial sums
    /// over the elements of the partition. Other operators, including stress relaxation, use all elements.
    #[must_use]
    pub fn share(self, number: usize, count: usize) -> Self {
        self.partition(number, count, None)
    }

    /// Returns the solid with workers that compute the others of the `count` partitions. The passes of this solid
    /// return complete sums.
    #[must_use]
    pub fn with_assembler(self, assembler: Arc<dyn ParallelAssembler>, count: usize) -> Self {
        self.partition(0, count, Some(assembler))
    }

    fn partition(
        mut self,
        number: usize,
        count: usize,
        assembler: Option<Arc<dyn ParallelAssembler>>,
    ) -> Self {
        let mut elements = self.elements.clone();
        with_elements!(&mut elements, mapped => mapped.keep_share(number, count));
        self.partition = Some(Box::new(Partition { elements, assembler }));
        self
    }

    /// Returns the elements that passes compute: the local partition, or all elements.
    pub(super) fn local_elements(&self) -> &Elements {
        match &self.partition {
            None => &self.elements,
            Some(partition) => &partition.elements,
        }
    }

    fn assembler(&self) -> Option<&Arc<dyn ParallelAssembler>> {
        self.partition.as_ref()?.assembler.as_ref()
    }

    /// Computes a pass over the local partition and writes the results, in the order in which they are declared.
    /// Other results become empty.
    ///
    /// # Errors
    /// Returns the errors of [`evaluate`](Self::evaluate).
    ///
    /// # Panics
    /// Panics if the pass itself panics.
    pub fn compute(&self, pass: &Pass<'_>, results: &mut Vec<Vec<f64>>) -> Result<(), Inverted> {
        let nodal = self.space.n_components();
        let scalar = self.space.n_pressures();
        let square = self.displacement_pattern.nnz();
        let wide = self.divergence_pattern.nnz();
        match pass {
            Pass::Vectors(fields, requested) => {
                let lengths = [nodal, nodal, scalar, scalar, nodal];
                self.evaluate(fields, &mut Vectors::from(resized(results, lengths, *requested)))
            }
            Pass::Tangents(fields, requested) => {
                let lengths = [square, square, square, wide, wide, square];
                self.tangents(fields, &mut Tangents::from(resized(results, lengths, *requested)))
            }
            Pass::AddedForce(motion) => {
                let [out] = resized(results, [nodal], [true]);
                out.into_iter().for_each(|out| self.added_force(motion, out));
                Ok(())
            }
            Pass::ActiveForce(motion) => {
                let [out] = resized(results, [nodal], [true]);
                out.into_iter().for_each(|out| self.active_force(motion, out));
                Ok(())
            }
            Pass::AddedTangents(motion, requested) => {
                let out = AddedTangents::from(resized(results, [square; 2], *requested));
                self.added_tangents(motion, out);
                Ok(())
            }
        }
    }

    /// Starts a pass on the workers.
    pub(super) fn begin(&self, pass: &Pass<'_>) {
        if let Some(assembler) = self.assembler() {
            assembler.begin(pass);
        }
    }

    /// Completes a pass by adding the results of the workers.
    pub(super) fn end<'a>(
        &self,
        results: impl IntoIterator<Item = &'a mut [f64]>,
        local: Result<(), Inverted>,
    ) -> Result<(), Inverted> {
        match self.assembler() {
            None => local,
            Some(assembler) => assembler.end(&mut results.into_iter().collect::<Vec<_>>(), local),
        }
    }

    /// Completes a pass that cannot fail.
    pub(super) fn end_infallible<'a>(&self, results: impl IntoIterator<Item = &'a mut [f64]>) {
        assert_infallible(self.end(results, Ok(())));
    }
}

/// Asserts that a pass that cannot fail succeeded.
pub(super) fn assert_infallible(ended: Result<(), Inverted>) {
    debug_assert!(ended.is_ok(), "added stresses are defined everywhere");
}

/// Resizes `results` to the given lengths and returns the requested vectors.
fn resized<const K: usize>(
    results: &mut Vec<Vec<f64>>,
    lengths: [usize; K],
    requested: [bool; K],
) -> [Option<&mut [f64]>; K] {
    results.resize(K, Vec::new());
    let mut lengths = lengths.into_iter().zip(requested);
    let mut vectors = results.iter_mut().map(|vector| {
        let (length, requested) = lengths.next().unwrap_or_default();
        vector.resize(if requested { length } else { 0 }, 0.0);
        requested.then_some(&mut vector[..])
    });
    std::array::from_fn(|_| vectors.next().flatten())
}

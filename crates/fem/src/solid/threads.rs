//! Multithreaded passes over the elements of large three-dimensional bodies.
//!
//! Threads compute element vectors and matrices batch by batch and store them in separate buffers. One thread adds
//! these to the global arrays in the order of the batches, while the other threads compute the next batches. The
//! sums are therefore bitwise equal to sequential sums. The additions take about a quarter of a pass and limit the
//! speedup.

use std::array::from_fn;
use std::ops::Range;
use std::slice::from_ref;
use std::sync::Arc;

use rayon::ThreadPool;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use crate::operators::fields::Inverted;
use crate::simd::batch::{Batch, BatchRange};
use crate::simd::lanes::LANES;
use crate::space::sparsity::{NO_ENTRY, ScatterMap};

use super::{MappedBatches, Solid};

/// Minimum number of batches for which several threads are used. A batch takes about 20 µs. Waking the threads and
/// distributing the work costs as much as a few batches.
const BATCHES_FROM: usize = 64;

/// Number of batches that each thread computes before their results are added. The number is large enough to keep
/// the threads busy, and small enough for the results to remain in the cache.
const AT_A_TIME: usize = 8;

/// Kind of the element results of a pass, which determines their size.
#[derive(Debug, Clone, Copy)]
pub(super) enum Entries {
    /// One value per component of each node.
    Vector,
    /// One value per pressure.
    PerPressure,
    /// Matrix whose rows and columns are components.
    Matrix,
    /// Matrix whose rows are pressures and whose columns are components.
    Divergence,
}

use Entries::{Divergence, Matrix, PerPressure, Vector};

/// Kinds of the results of `Vectors`, `Tangents` and `AddedTangents`.
pub(super) const VECTORS: [Entries; 5] = [Vector, Vector, PerPressure, PerPressure, Vector];
pub(super) const TANGENTS: [Entries; 6] = [Matrix, Matrix, Matrix, Divergence, Divergence, Matrix];
pub(super) const ADDED_TANGENTS: [Entries; 2] = [Matrix; 2];

impl Solid {
    /// Returns the solid with threads for its passes. The threads are used for large 3D bodies, unless the
    /// elements are partitioned among processes. The results are bitwise equal for any number of threads.
    #[must_use]
    pub fn in_threads(mut self, threads: Option<Arc<ThreadPool>>) -> Self {
        self.threads = threads.filter(|_| self.partition.is_none());
        self
    }
}

impl<const D: usize, const N: usize, const P: usize> MappedBatches<D, N, P> {
    /// Runs a pass over all elements. The function `compute` evaluates the pass for some of the batches, and the
    /// results are added to `requested`.
    pub(super) fn pass<const K: usize>(
        &self,
        threads: Option<&Arc<ThreadPool>>,
        entries: [Entries; K],
        mut requested: [Option<&mut [f64]>; K],
        compute: impl Fn(
            BatchRange<'_, D, N, P>,
            &[ScatterMap<D, N, P>],
            [Option<&mut [f64]>; K],
        ) -> Result<(), Inverted>
        + Sync,
    ) -> Result<(), Inverted> {
        let batches = &self.batches.batches[..];
        let lengths: [usize; K] = from_fn(|k| match requested[k] {
            Some(_) => LANES * entries[k].per_element::<D, N, P>(),
            None => 0,
        });
        let size = lengths.iter().sum::<usize>();
        let pays = D == 3 && batches.len() >= BATCHES_FROM && size > 0;
        let Some(pool) = threads.filter(|_| pays) else {
            return compute(self.batches.all(), &self.maps, requested);
        };
        for values in requested.iter_mut().flatten() {
            values.fill(0.0);
        }
        let map = ScatterMap::element_by_element();
        let mut add = |computed: Range<usize>, buffer: &[f64]| {
            let batches = batches[computed.clone()].iter().zip(&self.maps[computed]);
            for ((batch, map), mut buffer) in batches.zip(buffer.chunks_exact(size)) {
                for ((requested, entries), length) in requested.iter_mut().zip(entries).zip(lengths)
                {
                    if let Some(requested) = requested {
                        let (values, rest) = buffer.split_at(length);
                        buffer = rest;
                        entries.add(batch, map, values, requested);
                    }
                }
            }
        };
        pool.install(|| {
            let at_a_time = AT_A_TIME * rayon::current_num_threads();
            let mut buffers = [(); 2].map(|()| vec![0.0; at_a_time * size]);
            let mut computed = 0..0;
            for start in (0..batches.len()).step_by(at_a_time) {
                let next = start..batches.len().min(start + at_a_time);
                let [buffer, full] = &mut buffers;
                let work = batches[next.clone()].par_iter();
                let work = work.zip(buffer.par_chunks_exact_mut(size));
                let inverted = |(batch, buffer)| {
                    let buffer = parts(buffer, lengths);
                    compute(self.batches.element_wise(batch), from_ref(&map), buffer).err()
                };
                let (inverted, ()) =
                    rayon::join(|| work.find_map_first(inverted), || add(computed.clone(), full));
                if let Some(inverted) = inverted {
                    return Err(inverted);
                }
                buffers.swap(0, 1);
                computed = next;
            }
            add(computed, &buffers[1]);
            Ok(())
        })
    }
}

/// Splits a buffer into parts of the given lengths. A part of length 0 is `None`.
fn parts<const K: usize>(mut buffer: &mut [f64], lengths: [usize; K]) -> [Option<&mut [f64]>; K] {
    lengths.map(|length| {
        let (part, rest) = std::mem::take(&mut buffer).split_at_mut(length);
        buffer = rest;
        (length > 0).then_some(part)
    })
}

impl Entries {
    fn per_element<const D: usize, const N: usize, const P: usize>(self) -> usize {
        match self {
            Vector => N * D,
            PerPressure => P,
            Matrix => N * D * N * D,
            Divergence => N * D * P,
        }
    }

    /// Adds the entries of a batch to the global array. The entries are stored element by element.
    fn add<const D: usize, const N: usize, const P: usize>(
        self,
        batch: &Batch<D, N, P>,
        map: &ScatterMap<D, N, P>,
        values: &[f64],
        all: &mut [f64],
    ) {
        let element_values = values.chunks_exact(self.per_element::<D, N, P>());
        for (l, values) in element_values.take(batch.count).enumerate() {
            match self {
                Vector => {
                    for (nodes, values) in batch.nodes.iter().zip(values.chunks_exact(D)) {
                        let entries = &mut all[D * nodes[l]..][..D];
                        for (entry, values) in entries.iter_mut().zip(values) {
                            *entry += values;
                        }
                    }
                }
                PerPressure => {
                    for (pressures, values) in batch.pressures.iter().zip(values) {
                        all[pressures[l]] += values;
                    }
                }
                Matrix => {
                    let indices = map.displacement.as_flattened().as_flattened();
                    add_entry(indices.as_flattened(), l, values, all);
                }
                Divergence => {
                    let indices = map.divergence.as_flattened().as_flattened();
                    add_entry(indices, l, values, all);
                }
            }
        }
    }
}

/// Adds the entries of lane `l` at their indices.
fn add_entry(indices: &[[u32; LANES]], l: usize, values: &[f64], all: &mut [f64]) {
    for (indices, values) in indices.iter().zip(values) {
        if indices[l] != NO_ENTRY {
            all[indices[l] as usize] += values;
        }
    }
}

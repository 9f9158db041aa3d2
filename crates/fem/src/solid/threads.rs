//! Passes over the elements of large bodies in space, in several threads.
//!
//! Threads compute vectors and matrices of elements, a batch at a time, into room of its own; one of
//! them adds these to those of the body, in the order of the batches, while the others compute the
//! next. So the sums are those of one thread, to the last bit. How far threads help is limited by
//! the adding, about a quarter of a pass.

use std::array::from_fn;
use std::ops::Range;
use std::slice::from_ref;
use std::sync::Arc;

use rayon::ThreadPool;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use crate::operators::fields::Inverted;
use crate::simd::batch::{Batch, Stretch};
use crate::simd::lanes::LANES;
use crate::space::sparsity::{NOWHERE, ScatterMap};

use super::{Mapped, Solid};

/// Fewer batches are worked on by one thread: a pass takes some 20 µs for each, and to wake threads
/// and to hand it out as long as a few.
const BATCHES_FROM: usize = 64;

/// Batches for each thread that are computed before they are added: enough that threads seldom wait,
/// few enough to stay in the cache.
const AT_A_TIME: usize = 8;

/// What a pass gives for each element.
#[derive(Debug, Clone, Copy)]
pub(super) enum Entries {
    /// A number for each component of each node.
    Vector,
    /// A number for each pressure.
    Scalar,
    /// Rows and columns of components.
    Matrix,
    /// Rows of pressures, columns of components.
    Divergence,
}

use Entries::{Divergence, Matrix, Scalar, Vector};

/// Those of `Vectors`, `Tangents` and `AddedTangents`.
pub(super) const VECTORS: [Entries; 5] = [Vector, Vector, Scalar, Scalar, Vector];
pub(super) const TANGENTS: [Entries; 6] = [Matrix, Matrix, Matrix, Divergence, Divergence, Matrix];
pub(super) const ADDED_TANGENTS: [Entries; 2] = [Matrix; 2];

impl Solid {
    /// The solid whose passes run in these threads, if it is a large body in space and its elements are
    /// not shared out among processes. Results do not depend on their number, to the last bit.
    #[must_use]
    pub fn in_threads(mut self, threads: Option<Arc<ThreadPool>>) -> Self {
        self.threads = threads.filter(|_| self.shared.is_none());
        self
    }
}

impl<const D: usize, const N: usize, const P: usize> Mapped<D, N, P> {
    /// Fills what is wanted of a pass over all elements; `compute` fills it for some of the batches.
    pub(super) fn pass<const K: usize>(
        &self,
        threads: Option<&Arc<ThreadPool>>,
        entries: [Entries; K],
        mut wanted: [Option<&mut [f64]>; K],
        compute: impl Fn(
            Stretch<'_, D, N, P>,
            &[ScatterMap<D, N, P>],
            [Option<&mut [f64]>; K],
        ) -> Result<(), Inverted>
        + Sync,
    ) -> Result<(), Inverted> {
        let batches = &self.batches.batches[..];
        let lengths: [usize; K] = from_fn(|k| match wanted[k] {
            Some(_) => LANES * entries[k].of_element::<D, N, P>(),
            None => 0,
        });
        let size = lengths.iter().sum::<usize>();
        let pays = D == 3 && batches.len() >= BATCHES_FROM && size > 0;
        let Some(pool) = threads.filter(|_| pays) else {
            return compute(self.batches.all(), &self.maps, wanted);
        };
        for values in wanted.iter_mut().flatten() {
            values.fill(0.0);
        }
        let map = ScatterMap::apart();
        let mut add = |computed: Range<usize>, room: &[f64]| {
            let batches = batches[computed.clone()].iter().zip(&self.maps[computed]);
            for ((batch, map), mut room) in batches.zip(room.chunks_exact(size)) {
                for ((wanted, entries), length) in wanted.iter_mut().zip(entries).zip(lengths) {
                    if let Some(wanted) = wanted {
                        let (own, rest) = room.split_at(length);
                        room = rest;
                        entries.add(batch, map, own, wanted);
                    }
                }
            }
        };
        pool.install(|| {
            let at_a_time = AT_A_TIME * rayon::current_num_threads();
            let mut rooms = [(); 2].map(|()| vec![0.0; at_a_time * size]);
            let mut computed = 0..0;
            for start in (0..batches.len()).step_by(at_a_time) {
                let next = start..batches.len().min(start + at_a_time);
                let [room, full] = &mut rooms;
                let work = batches[next.clone()].par_iter();
                let work = work.zip(room.par_chunks_exact_mut(size));
                let inverted = |(batch, room)| {
                    let room = parts(room, lengths);
                    compute(self.batches.apart(batch), from_ref(&map), room).err()
                };
                let (inverted, ()) = rayon::join(
                    || work.find_map_first(inverted),
                    || add(computed.clone(), full),
                );
                if let Some(inverted) = inverted {
                    return Err(inverted);
                }
                rooms.swap(0, 1);
                computed = next;
            }
            add(computed, &rooms[1]);
            Ok(())
        })
    }
}

/// Parts of `room` of these lengths, none for those without.
fn parts<const K: usize>(mut room: &mut [f64], lengths: [usize; K]) -> [Option<&mut [f64]>; K] {
    lengths.map(|length| {
        let (part, rest) = std::mem::take(&mut room).split_at_mut(length);
        room = rest;
        (length > 0).then_some(part)
    })
}

impl Entries {
    /// How many an element has.
    fn of_element<const D: usize, const N: usize, const P: usize>(self) -> usize {
        match self {
            Vector => N * D,
            Scalar => P,
            Matrix => N * D * N * D,
            Divergence => N * D * P,
        }
    }

    /// Adds those of a batch, one element after the other, to those of the body.
    fn add<const D: usize, const N: usize, const P: usize>(
        self,
        batch: &Batch<D, N, P>,
        map: &ScatterMap<D, N, P>,
        own: &[f64],
        all: &mut [f64],
    ) {
        let of_elements = own.chunks_exact(self.of_element::<D, N, P>());
        for (l, own) in of_elements.take(batch.count).enumerate() {
            match self {
                Vector => {
                    for (nodes, own) in batch.nodes.iter().zip(own.chunks_exact(D)) {
                        let entries = &mut all[D * nodes[l]..][..D];
                        for (entry, own) in entries.iter_mut().zip(own) {
                            *entry += own;
                        }
                    }
                }
                Scalar => {
                    for (pressures, own) in batch.pressures.iter().zip(own) {
                        all[pressures[l]] += own;
                    }
                }
                Matrix => {
                    let places = map.displacement.as_flattened().as_flattened();
                    put(places.as_flattened(), l, own, all);
                }
                Divergence => {
                    let places = map.divergence.as_flattened().as_flattened();
                    put(places, l, own, all);
                }
            }
        }
    }
}

/// Adds the entries of an element at their places.
fn put(places: &[[u32; LANES]], l: usize, own: &[f64], all: &mut [f64]) {
    for (places, own) in places.iter().zip(own) {
        if places[l] != NOWHERE {
            all[places[l] as usize] += own;
        }
    }
}

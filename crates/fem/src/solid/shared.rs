//! A solid whose elements are shared out.

use std::sync::Arc;

use crate::operators::added::AddedTangents;
use crate::operators::fields::{Inverted, Tangents, Vectors};
use crate::solid::crew::{Crew, Pass};

use super::{Elements, Mapped, Solid, with_elements};

impl<const D: usize, const N: usize, const P: usize> Mapped<D, N, P> {
    /// Keeps one of `count` shares: as many batches of each law and each added stress.
    fn keep_share(&mut self, number: usize, count: usize) {
        let mut kept = Vec::new();
        let batches = &self.batches.batches;
        for alike in
            batches.chunk_by(|a, b| a.kind.law == b.kind.law && a.kind.added == b.kind.added)
        {
            let share = |number: usize| alike.len() * number / count;
            kept.extend((0..alike.len()).map(|k| (share(number)..share(number + 1)).contains(&k)));
        }
        let mut of_batches = kept.iter();
        self.batches
            .batches
            .retain(|_| *of_batches.next().unwrap_or(&false));
        let mut of_maps = kept.iter();
        self.maps.retain(|_| *of_maps.next().unwrap_or(&false));
    }
}

/// What a solid whose elements are shared out keeps beside them.
#[derive(Debug, Clone)]
pub(super) struct Shared {
    elements: Elements,
    /// None: the sums are those of the share.
    crew: Option<Arc<dyn Crew>>,
}

impl Solid {
    /// The solid with share `number` of `count` of the elements: its [passes](Pass) give the part of
    /// these in the sums. All else, relaxing stresses too, is that of the whole.
    #[must_use]
    pub fn share(self, number: usize, count: usize) -> Self {
        self.shared(number, count, None)
    }

    /// The solid with a crew of `count`, itself included, who hold the other shares: its passes give
    /// the whole sums.
    #[must_use]
    pub fn with_crew(self, crew: Arc<dyn Crew>, count: usize) -> Self {
        self.shared(0, count, Some(crew))
    }

    fn shared(mut self, number: usize, count: usize, crew: Option<Arc<dyn Crew>>) -> Self {
        let mut elements = self.elements.clone();
        with_elements!(&mut elements, mapped => mapped.keep_share(number, count));
        self.shared = Some(Box::new(Shared { elements, crew }));
        self
    }

    /// The elements that passes go over.
    pub(super) fn own_elements(&self) -> &Elements {
        match &self.shared {
            None => &self.elements,
            Some(shared) => &shared.elements,
        }
    }

    fn crew(&self) -> Option<&Arc<dyn Crew>> {
        self.shared.as_ref()?.crew.as_ref()
    }

    /// Computes a pass over its share of the elements, into vectors in the order of their declaration; those
    /// not wanted become empty.
    ///
    /// # Errors
    /// As for [`evaluate`](Self::evaluate).
    ///
    /// # Panics
    /// As for the pass itself.
    pub fn compute(&self, pass: &Pass<'_>, results: &mut Vec<Vec<f64>>) -> Result<(), Inverted> {
        let nodal = self.space.n_components();
        let scalar = self.space.n_pressures();
        let square = self.displacement_pattern.nnz();
        let wide = self.divergence_pattern.nnz();
        match pass {
            Pass::Vectors(fields, wanted) => {
                let lengths = [nodal, nodal, scalar, scalar, nodal];
                self.evaluate(fields, &mut Vectors::from(room(results, lengths, *wanted)))
            }
            Pass::Tangents(fields, wanted) => {
                let lengths = [square, square, square, wide, wide, square];
                self.tangents(fields, &mut Tangents::from(room(results, lengths, *wanted)))
            }
            Pass::AddedForce(motion) => {
                let [out] = room(results, [nodal], [true]);
                out.into_iter()
                    .for_each(|out| self.added_force(motion, out));
                Ok(())
            }
            Pass::ActiveForce(motion) => {
                let [out] = room(results, [nodal], [true]);
                out.into_iter()
                    .for_each(|out| self.active_force(motion, out));
                Ok(())
            }
            Pass::AddedTangents(motion, wanted) => {
                let out = AddedTangents::from(room(results, [square; 2], *wanted));
                self.added_tangents(motion, out);
                Ok(())
            }
        }
    }

    /// Has the crew begin with a pass.
    pub(super) fn begin(&self, pass: &Pass<'_>) {
        if let Some(crew) = self.crew() {
            crew.begin(pass);
        }
    }

    /// The results of all elements, from those of one's own.
    pub(super) fn end<'a>(
        &self,
        results: impl IntoIterator<Item = &'a mut [f64]>,
        own: Result<(), Inverted>,
    ) -> Result<(), Inverted> {
        match self.crew() {
            None => own,
            Some(crew) => crew.end(&mut results.into_iter().collect::<Vec<_>>(), own),
        }
    }

    /// The same for a pass that cannot fail.
    pub(super) fn end_sure<'a>(&self, results: impl IntoIterator<Item = &'a mut [f64]>) {
        sure(self.end(results, Ok(())));
    }
}

/// Of a pass that cannot fail.
pub(super) fn sure(ended: Result<(), Inverted>) {
    debug_assert!(ended.is_ok(), "added stresses are defined everywhere");
}

/// Vectors of these lengths where they are wanted.
fn room<const K: usize>(
    results: &mut Vec<Vec<f64>>,
    lengths: [usize; K],
    wanted: [bool; K],
) -> [Option<&mut [f64]>; K] {
    results.resize(K, Vec::new());
    let mut lengths = lengths.into_iter().zip(wanted);
    let mut vectors = results.iter_mut().map(|vector| {
        let (length, wanted) = lengths.next().unwrap_or_default();
        vector.resize(if wanted { length } else { 0 }, 0.0);
        wanted.then_some(&mut vector[..])
    });
    std::array::from_fn(|_| vectors.next().flatten())
}

//! Where internal stresses lie in a vector.

use std::ops::Range;

use crate::material::Prony;
use crate::material::three::Tensor3;
use crate::simd::batch::Batches;

/// The elements with the same Prony terms, and where their internal stresses lie.
///
/// A slot is one component of a symmetric tensor at one quadrature point of one element; those that are
/// zero in plane strain have none.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxingPart {
    /// The terms.
    pub prony: Prony,
    /// Its slots among those of the body.
    pub slots: Range<usize>,
    /// Its internal stresses: one at each slot for the first term, then for the second, …
    pub states: Range<usize>,
}

/// Where the internal stresses of a body lie.
#[derive(Debug, Clone, Default)]
pub(crate) struct InternalStresses {
    pub(crate) parts: Vec<RelaxingPart>,
    /// The first slot of each batch that has some.
    pub(super) first: Vec<usize>,
    /// For each element up to the last that has some: its first slot, and how far the next is.
    strips: Vec<Option<[usize; 2]>>,
}

/// The places of the components of a symmetric tensor among the slots of a point, by row and column.
pub(super) const fn places(dimension: usize) -> &'static [[usize; 2]] {
    match dimension {
        2 => &[[0, 0], [0, 1], [1, 1], [2, 2]],
        _ => &[[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]],
    }
}

impl InternalStresses {
    /// One part for each of `prony`.
    pub(crate) fn new<const D: usize, const N: usize, const P: usize>(
        elements: &Batches<D, N, P>,
        prony: &[Prony],
    ) -> Self {
        let mut first = vec![0; elements.batches.len()];
        let mut strips = Vec::new();
        let (mut slot, mut state) = (0, 0);
        let mut part = |(number, prony): (usize, &Prony)| {
            let start = slot;
            let batches = elements.batches.iter().zip(&mut first);
            for (batch, first) in batches.filter(|(b, _)| b.kind.relaxing == Some(number)) {
                *first = slot;
                for (lane, &element) in batch.elements[..batch.count].iter().enumerate() {
                    strips.resize(strips.len().max(element + 1), None);
                    strips[element] = Some([slot + lane, batch.count]);
                }
                slot += elements.points.len() * batch.count * places(D).len();
            }
            let states = state..state + prony.terms().len() * (slot - start);
            state = states.end;
            RelaxingPart {
                prony: prony.clone(),
                slots: start..slot,
                states,
            }
        };
        let parts = prony.iter().enumerate().map(&mut part).collect();
        Self {
            parts,
            first,
            strips,
        }
    }

    /// Σ Q at the quadrature points of an element, those of the first before the others; nothing for an
    /// element without terms.
    pub(crate) fn sums<'a>(
        &'a self,
        (dimension, element): (usize, usize),
        internal: &'a [f64],
    ) -> Option<(&'a Prony, impl Fn(usize) -> Tensor3 + 'a)> {
        let [first, stride] = (*self.strips.get(element)?)?;
        let mut parts = self.parts.iter();
        let part = parts.find(|part| part.slots.contains(&first))?;
        let of_part = &internal[part.states.clone()];
        let sum = move |point: usize| {
            let mut tensor = [[0.0; 3]; 3];
            let components = places(dimension);
            for (number, &[i, j]) in components.iter().enumerate() {
                let slot = first + (point * components.len() + number) * stride;
                let terms = of_part.chunks(part.slots.len());
                tensor[i][j] = terms.map(|term| term[slot - part.slots.start]).sum();
                tensor[j][i] = tensor[i][j];
            }
            tensor
        };
        Some((&part.prony, sum))
    }
}

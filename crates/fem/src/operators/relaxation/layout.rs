//! Layout of the vector of internal stresses.

use std::ops::Range;

use crate::material::Prony;
use crate::material::three::Tensor3;
use crate::simd::batch::Batches;

/// Elements with the same Prony series, and the locations of their internal stresses in the vector.
///
/// A slot is one component of a symmetric tensor at a quadrature point of an element. Components that vanish in
/// plane strain have no slot.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxationRegion {
    /// Prony series.
    pub prony: Prony,
    /// Range of the slots of the region.
    pub slots: Range<usize>,
    /// Range of the internal stresses of the region. It contains one value per slot for the first term, then for
    /// the second term, and so on.
    pub states: Range<usize>,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct InternalStresses {
    pub(crate) parts: Vec<RelaxationRegion>,
    /// First slot of each viscoelastic batch.
    pub(super) first: Vec<usize>,
    /// First slot and slot stride of each element, or `None` if it is not viscoelastic. The list ends at the last
    /// viscoelastic element.
    strips: Vec<Option<[usize; 2]>>,
}

/// Returns the row and column of the stress component in each slot of a point.
pub(super) const fn component_indices(dimension: usize) -> &'static [[usize; 2]] {
    match dimension {
        2 => &[[0, 0], [0, 1], [1, 1], [2, 2]],
        _ => &[[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]],
    }
}

impl InternalStresses {
    /// Creates the layout. There is one region per series in `prony`.
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
            for (batch, first) in batches.filter(|(b, _)| b.material.prony == Some(number)) {
                *first = slot;
                for (lane, &element) in batch.elements[..batch.count].iter().enumerate() {
                    strips.resize(strips.len().max(element + 1), None);
                    strips[element] = Some([slot + lane, batch.count]);
                }
                slot += elements.points.len() * batch.count * component_indices(D).len();
            }
            let states = state..state + prony.terms().len() * (slot - start);
            state = states.end;
            RelaxationRegion { prony: prony.clone(), slots: start..slot, states }
        };
        let parts = prony.iter().enumerate().map(&mut part).collect();
        Self { parts, first, strips }
    }

    /// Returns the Prony series of an element and a function that returns Σ Q at its quadrature points. Returns
    /// `None` if the element has no series.
    pub(crate) fn sums<'a>(
        &'a self,
        (dimension, element): (usize, usize),
        internal: &'a [f64],
    ) -> Option<(&'a Prony, impl Fn(usize) -> Tensor3 + 'a)> {
        let [first, stride] = (*self.strips.get(element)?)?;
        let mut parts = self.parts.iter();
        let part = parts.find(|part| part.slots.contains(&first))?;
        let internal = &internal[part.states.clone()];
        let sum = move |point: usize| {
            let mut tensor = [[0.0; 3]; 3];
            let components = component_indices(dimension);
            for (number, &[i, j]) in components.iter().enumerate() {
                let slot = first + (point * components.len() + number) * stride;
                let terms = internal.chunks(part.slots.len());
                tensor[i][j] = terms.map(|term| term[slot - part.slots.start]).sum();
                tensor[j][i] = tensor[i][j];
            }
            tensor
        };
        Some((&part.prony, sum))
    }
}

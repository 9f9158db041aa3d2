//! All batches of a space.

use super::{Batch, Point};
use crate::element::Barycentric;
use crate::element::quadrature::Rule;
use crate::material::fibres::Fibres;
use crate::material::three::Axes;
use crate::simd::lanes::{Array, LANES};
use crate::solid::kind::Kind;
use crate::space::Space;

/// The batches that a loop goes over.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch<'a, const D: usize, const N: usize, const P: usize> {
    pub(crate) points: &'a [Point<D, N, P>],
    pub(crate) batches: &'a [Batch<D, N, P>],
    /// Whether it is one batch whose vectors go element by element, without sums at nodes: element l
    /// of the batch has its nodes from number `l N` on, its pressures from `l P` on.
    pub(crate) apart: bool,
}

/// The element loop's data: batches and the table of quadrature points.
#[derive(Debug, Clone)]
pub(crate) struct Batches<const D: usize, const N: usize, const P: usize> {
    pub(crate) points: Vec<Point<D, N, P>>,
    pub(crate) batches: Vec<Batch<D, N, P>>,
}

impl<const D: usize, const N: usize, const P: usize> Batches<D, N, P> {
    /// All batches.
    pub(crate) fn all(&self) -> Stretch<'_, D, N, P> {
        Stretch {
            points: &self.points,
            batches: &self.batches,
            apart: false,
        }
    }

    /// One batch, with its vectors element by element.
    pub(crate) fn apart<'a>(&'a self, batch: &'a Batch<D, N, P>) -> Stretch<'a, D, N, P> {
        Stretch {
            points: &self.points,
            batches: std::slice::from_ref(batch),
            apart: true,
        }
    }

    /// Gives the axes of fibres at each point to the batches whose law asks for them, or whose added
    /// stress, by its number, `is_active`.
    pub(crate) fn set_fibres(&mut self, fibres: &Fibres, is_active: impl Fn(usize) -> bool) {
        let Self { points, batches } = self;
        let asks = |batch: &&mut Batch<D, N, P>| {
            batch.kind.law.has_fibres() || batch.kind.added.is_some_and(&is_active)
        };
        for batch in batches.iter_mut().filter(asks) {
            let axes = |point: &Point<D, N, P>| {
                let mut arrays = [[Array::ZERO; 3]; 2];
                for (l, &element) in batch.elements.iter().enumerate() {
                    let Axes { fibre, sheet } = fibres.axes(element, &point.psi);
                    for (array, vector) in arrays.iter_mut().zip([fibre, sheet]) {
                        for (array, x) in array.iter_mut().zip(vector) {
                            array.0[l] = x;
                        }
                    }
                }
                arrays
            };
            batch.axes = points.iter().map(axes).collect();
        }
    }

    /// Batches of the elements grouped by kind, curved ones apart, in the order of the mesh.
    pub(crate) fn new(space: &Space, kinds: &[Kind], rule: Rule) -> Self {
        let shape = space.mesh().shape();
        let table = |lambda: Barycentric| {
            let gradients = shape.gradients(space.degree(), &lambda);
            gradients.try_into().expect("N nodes")
        };
        let points: Vec<_> = rule
            .points(shape)
            .into_iter()
            .map(|q| Point {
                weight: q.weight,
                psi: (*q.barycentric).try_into().expect("P vertices"),
                gradients: table(q.barycentric),
            })
            .collect();
        let mut groups: Vec<((Kind, bool), Vec<usize>)> = Vec::new();
        for (element, &kind) in kinds.iter().enumerate() {
            let kind = (kind, space.is_curved(element));
            match groups.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, members)) => members.push(element),
                None => groups.push((kind, vec![element])),
            }
        }
        let batches = groups
            .iter()
            .flat_map(|((kind, _), members)| {
                members
                    .chunks(LANES)
                    .map(|chunk| Batch::new(space, *kind, chunk, &points))
            })
            .collect();
        Self { points, batches }
    }
}

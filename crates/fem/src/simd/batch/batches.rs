//! Batches that contain all elements of a space.

use super::{Batch, Point};
use crate::element::Barycentric;
use crate::element::quadrature::Rule;
use crate::material::fibers::Fibers;
use crate::material::three::Axes;
use crate::simd::lanes::{Array, LANES};
use crate::solid::element_material::ElementMaterial;
use crate::space::Space;

#[derive(Debug, Clone, Copy)]
pub(crate) struct BatchRange<'a, const D: usize, const N: usize, const P: usize> {
    pub(crate) points: &'a [Point<D, N, P>],
    pub(crate) batches: &'a [Batch<D, N, P>],
    /// Whether the pass computes a single batch whose vectors are stored element by element, without summation at
    /// nodes. The nodes of element l start at `l N`, and its pressures start at `l P`.
    pub(crate) element_wise: bool,
}

/// Batches of elements and the table of quadrature points.
#[derive(Debug, Clone)]
pub(crate) struct Batches<const D: usize, const N: usize, const P: usize> {
    pub(crate) points: Vec<Point<D, N, P>>,
    pub(crate) batches: Vec<Batch<D, N, P>>,
}

impl<const D: usize, const N: usize, const P: usize> Batches<D, N, P> {
    pub(crate) fn all(&self) -> BatchRange<'_, D, N, P> {
        BatchRange { points: &self.points, batches: &self.batches, element_wise: false }
    }

    /// Returns a range of one batch with vectors stored element by element.
    pub(crate) fn element_wise<'a>(&'a self, batch: &'a Batch<D, N, P>) -> BatchRange<'a, D, N, P> {
        BatchRange {
            points: &self.points,
            batches: std::slice::from_ref(batch),
            element_wise: true,
        }
    }

    /// Stores the fiber axes at each point for batches whose law depends on fibers or whose added stress is
    /// active. The argument of `is_active` is the index of the added stress.
    pub(crate) fn set_fibers(&mut self, fibers: &Fibers, is_active: impl Fn(usize) -> bool) {
        let Self { points, batches } = self;
        let needs_axes = |batch: &&mut Batch<D, N, P>| {
            batch.material.law.has_fibers() || batch.material.added.is_some_and(&is_active)
        };
        for batch in batches.iter_mut().filter(needs_axes) {
            let axes = |point: &Point<D, N, P>| {
                let mut arrays = [[Array::ZERO; 3]; 2];
                for (l, &element) in batch.elements.iter().enumerate() {
                    let Axes { fiber, sheet } = fibers.axes(element, &point.psi);
                    for (array, vector) in arrays.iter_mut().zip([fiber, sheet]) {
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

    /// Groups the elements by material and by straight or curved shape. The elements remain in the order of the
    /// mesh.
    pub(crate) fn new(space: &Space, materials: &[ElementMaterial], rule: Rule) -> Self {
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
        let mut groups: Vec<((ElementMaterial, bool), Vec<usize>)> = Vec::new();
        for (element, &material) in materials.iter().enumerate() {
            let material = (material, space.is_curved(element));
            match groups.iter_mut().find(|(known, _)| *known == material) {
                Some((_, members)) => members.push(element),
                None => groups.push((material, vec![element])),
            }
        }
        let batches = groups
            .iter()
            .flat_map(|((material, _), members)| {
                members.chunks(LANES).map(|chunk| Batch::new(space, *material, chunk, &points))
            })
            .collect();
        Self { points, batches }
    }
}

//! Elements in batches of [`LANES`], laid out for vector instructions.
//!
//! Cast: a [`Batch`] keeps what is known of its elements; a [`Part`] of it is as many elements as a
//! register has lanes, and [`Lanes`] one number for each of these. Every element is computed alone,
//! so results do not depend on the width of the registers, to the last bit.
//!
//! A batch holds elements of one law. Per element it keeps the inverse of the affine map and the
//! area; shape gradients are kept once per quadrature point in reference coordinates, so a batch
//! moves little memory. Lanes beyond the last element repeat it with area zero. Note 0002.

use std::ops::Range;

use pulp::Simd;

use crate::element::{inverse_map, p1_gradients, p2_gradients};
use crate::lanes::{Array, LANES, Lanes};
use crate::material::tensor::TensorOf;
use crate::material::{Law, Real};
use crate::quadrature::TriangleRule;
use crate::space::Space;

/// A quadrature point: weight as a fraction of the area, pressure shape functions (which are the
/// barycentric coordinates), reference gradients of the displacement's.
#[derive(Debug, Clone)]
pub(crate) struct Point<const N: usize> {
    pub(crate) weight: f64,
    pub(crate) psi: [f64; 3],
    pub(crate) gradients: [[f64; 2]; N],
}

/// Up to [`LANES`] elements of one law.
#[derive(Debug, Clone)]
pub(crate) struct Batch<const N: usize> {
    pub(crate) law: Law,
    pub(crate) elements: [usize; LANES],
    /// Elements that count; the others repeat the last with area zero.
    pub(crate) count: usize,
    pub(crate) nodes: [[usize; LANES]; N],
    /// ∂(ξ, η)/∂x.
    inverse: TensorOf<Array>,
    area: Array,
}

impl<const N: usize> Batch<N> {
    fn new(space: &Space, law: Law, members: &[usize]) -> Self {
        let elements = std::array::from_fn(|l| members[l.min(members.len() - 1)]);
        let mut inverse = [[Array::ZERO; 2]; 2];
        let mut area = Array::ZERO;
        for (l, &element) in elements.iter().enumerate() {
            let (map, det) = inverse_map(space.mesh().corners(element));
            for (row, map) in inverse.iter_mut().zip(map) {
                for (entry, map) in row.iter_mut().zip(map) {
                    entry.0[l] = map;
                }
            }
            area.0[l] = if l < members.len() { 0.5 * det } else { 0.0 };
        }
        let nodes = std::array::from_fn(|a| elements.map(|e| space.element_nodes(e)[a]));
        Self {
            law,
            elements,
            count: members.len(),
            nodes,
            inverse,
            area,
        }
    }
}

/// The elements of a batch that fit a register.
pub(crate) struct Part<'a, S: Simd, const N: usize> {
    simd: S,
    batch: &'a Batch<N>,
    /// The lanes of the batch, those without element included.
    lanes: Range<usize>,
    inverse: TensorOf<Lanes<S>>,
    area: Lanes<S>,
}

impl<const N: usize> Batch<N> {
    /// Number of parts that have elements.
    #[inline(always)]
    pub(crate) fn n_parts<S: Simd>(&self, _: S) -> usize {
        self.count.div_ceil(S::F64_LANES)
    }

    /// One of the parts.
    #[inline(always)]
    pub(crate) fn part<S: Simd>(&self, simd: S, part: usize) -> Part<'_, S, N> {
        let mut inverse = [[Lanes::zero(simd); 2]; 2];
        for (row, arrays) in inverse.iter_mut().zip(&self.inverse) {
            for (entry, array) in row.iter_mut().zip(arrays) {
                *entry = Lanes::load(simd, array, part);
            }
        }
        Part {
            simd,
            batch: self,
            lanes: part * S::F64_LANES..(part + 1) * S::F64_LANES,
            inverse,
            area: Lanes::load(simd, &self.area, part),
        }
    }
}

impl<S: Simd, const N: usize> Part<'_, S, N> {
    #[inline(always)]
    pub(crate) fn zero(&self) -> Lanes<S> {
        Lanes::zero(self.simd)
    }

    /// The element of a lane of the part.
    pub(crate) fn element(&self, lane: usize) -> usize {
        self.batch.elements[self.lanes.start + lane]
    }

    /// The lanes of the batch with elements.
    #[inline(always)]
    pub(crate) fn occupied(&self) -> Range<usize> {
        self.lanes.start..self.lanes.end.min(self.batch.count)
    }

    /// The nodes in one place of the elements.
    #[inline(always)]
    fn nodes(&self, place: usize) -> &[usize] {
        &self.batch.nodes[place][self.lanes.clone()]
    }

    /// Nodal values of a displacement-like field, zero if there is none.
    #[inline(always)]
    pub(crate) fn gather_vector(&self, field: Option<&[f64]>) -> [[Lanes<S>; 2]; N] {
        let mut values = [[self.zero(); 2]; N];
        if let Some(field) = field {
            for (place, [x, y]) in values.iter_mut().enumerate() {
                let lanes = x.as_mut_slice().iter_mut().zip(y.as_mut_slice());
                for ((x, y), &node) in lanes.zip(self.nodes(place)) {
                    let at_node = &field[2 * node..][..2];
                    (*x, *y) = (at_node[0], at_node[1]);
                }
            }
        }
        values
    }

    /// Vertex values of a pressure-like field, zero if there is none.
    #[inline(always)]
    pub(crate) fn gather_scalar(&self, field: Option<&[f64]>) -> [Lanes<S>; 3] {
        let mut values = [self.zero(); 3];
        if let Some(field) = field {
            for (place, value) in values.iter_mut().enumerate() {
                for (lane, &node) in value.as_mut_slice().iter_mut().zip(self.nodes(place)) {
                    *lane = field[node];
                }
            }
        }
        values
    }

    /// Corner values of the law's factors.
    #[inline(always)]
    pub(crate) fn gather_factors(&self, factors: &[[f64; 3]]) -> [Lanes<S>; 3] {
        let mut values = [self.zero(); 3];
        for (corner, value) in values.iter_mut().enumerate() {
            for (lane, factor) in value.as_mut_slice().iter_mut().enumerate() {
                *factor = factors[self.element(lane)][corner];
            }
        }
        values
    }

    /// Adds element vectors to a displacement-like array.
    #[inline(always)]
    pub(crate) fn scatter_vector(&self, local: &[[Lanes<S>; 2]; N], field: &mut [f64]) {
        for (lane, l) in self.occupied().enumerate() {
            for (nodes, values) in self.batch.nodes.iter().zip(local) {
                let entries = &mut field[2 * nodes[l]..][..2];
                entries[0] += values[0].as_slice()[lane];
                entries[1] += values[1].as_slice()[lane];
            }
        }
    }

    /// Adds element vectors to a pressure-like array.
    #[inline(always)]
    pub(crate) fn scatter_scalar(&self, local: &[Lanes<S>; 3], field: &mut [f64]) {
        for (lane, l) in self.occupied().enumerate() {
            for (nodes, values) in self.batch.nodes.iter().zip(local) {
                field[nodes[l]] += values.as_slice()[lane];
            }
        }
    }

    /// ∇u at a quadrature point: the reference gradient times the inverse map.
    #[inline(always)]
    pub(crate) fn gradient(&self, u: &[[Lanes<S>; 2]; N], point: &Point<N>) -> TensorOf<Lanes<S>> {
        let mut h = [[self.zero(); 2]; 2];
        let [xi, eta] = self.inverse;
        for (i, row) in h.iter_mut().enumerate() {
            let mut reference = [self.zero(); 2];
            for (value, gradient) in u.iter().zip(&point.gradients) {
                for (sum, &gradient) in reference.iter_mut().zip(gradient) {
                    *sum = value[i].mul_add(sum.like(gradient), *sum);
                }
            }
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = reference[0].mul_add(xi[j], reference[1] * eta[j]);
            }
        }
        h
    }

    /// A pressure-like field at a quadrature point.
    #[inline(always)]
    pub(crate) fn interpolate(&self, p: &[Lanes<S>; 3], point: &Point<N>) -> Lanes<S> {
        p[0] * point.psi[0] + p[1] * point.psi[1] + p[2] * point.psi[2]
    }

    /// ∂(ξ, η)/∂x.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> &TensorOf<Lanes<S>> {
        &self.inverse
    }

    /// w T J⁻ᵀ: ready for the product with reference gradients, the quadrature weight included.
    #[inline(always)]
    pub(crate) fn pull_back(
        &self,
        point: &Point<N>,
        tensor: &TensorOf<Lanes<S>>,
    ) -> TensorOf<Lanes<S>> {
        let weights = self.weights(point);
        let mut out = [[self.zero(); 2]; 2];
        for (row, tensor) in out.iter_mut().zip(tensor) {
            for (entry, inverse) in row.iter_mut().zip(&self.inverse) {
                *entry = weights * tensor[0].mul_add(inverse[0], tensor[1] * inverse[1]);
            }
        }
        out
    }

    /// The quadrature weights of a point.
    #[inline(always)]
    pub(crate) fn weights(&self, point: &Point<N>) -> Lanes<S> {
        self.area * point.weight
    }
}

/// The element loop's data: batches and the table of quadrature points.
#[derive(Debug, Clone)]
pub(crate) struct Batches<const N: usize> {
    pub(crate) points: Vec<Point<N>>,
    pub(crate) batches: Vec<Batch<N>>,
}

impl<const N: usize> Batches<N> {
    /// Batches of the elements grouped by law, in the order of the mesh.
    fn new(
        space: &Space,
        laws: &[Law],
        rule: TriangleRule,
        gradients: impl Fn([f64; 3]) -> [[f64; 2]; N],
    ) -> Self {
        let points = rule
            .points()
            .into_iter()
            .map(|q| Point {
                weight: q.weight,
                psi: q.barycentric,
                gradients: gradients(q.barycentric),
            })
            .collect();
        let mut groups: Vec<(Law, Vec<usize>)> = Vec::new();
        for (element, &law) in laws.iter().enumerate() {
            match groups.iter_mut().find(|(known, _)| *known == law) {
                Some((_, members)) => members.push(element),
                None => groups.push((law, vec![element])),
            }
        }
        let batches = groups
            .iter()
            .flat_map(|(law, members)| {
                members
                    .chunks(LANES)
                    .map(|chunk| Batch::new(space, *law, chunk))
            })
            .collect();
        Self { points, batches }
    }
}

impl Batches<3> {
    pub(crate) fn linear(space: &Space, laws: &[Law], rule: TriangleRule) -> Self {
        Self::new(space, laws, rule, |_| p1_gradients())
    }
}

impl Batches<6> {
    pub(crate) fn quadratic(space: &Space, laws: &[Law], rule: TriangleRule) -> Self {
        Self::new(space, laws, rule, p2_gradients)
    }
}

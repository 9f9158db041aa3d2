//! Elements in batches of [`LANES`], laid out so that loops over lanes become vector instructions.
//!
//! A batch holds elements of one law. Per element it keeps the inverse of the affine map and the
//! area; shape gradients are kept once per quadrature point in reference coordinates, so a batch
//! moves little memory. Lanes beyond the last element repeat it with area zero. Note 0002.

use std::ops::{Add, AddAssign, Mul};

use crate::element::{inverse_map, p1_gradients, p2_gradients};
use crate::material::{Law, Tensor};
use crate::quadrature::TriangleRule;
use crate::space::Space;

/// Elements per batch: one AVX-512 register of f64, two of AVX2.
pub(crate) const LANES: usize = 8;

/// One number per element of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub(crate) struct Lanes(pub(crate) [f64; LANES]);

impl Lanes {
    pub(crate) const ZERO: Self = Self([0.0; LANES]);
}

/// The [`Lanes`] of an expression in the lane's number.
///
/// A macro, not a function of a closure: what is not inlined has no vector instructions.
macro_rules! lanes {
    ($l:ident => $value:expr) => {{
        let mut lanes = $crate::batch::Lanes::ZERO;
        for $l in 0..$crate::batch::LANES {
            lanes.0[$l] = $value;
        }
        lanes
    }};
}
pub(crate) use lanes;

/// The [`TensorLanes`] of an expression in the lane's number.
macro_rules! tensor_lanes {
    ($l:ident => $value:expr) => {{
        let mut lanes = [[$crate::batch::Lanes::ZERO; 2]; 2];
        for $l in 0..$crate::batch::LANES {
            $crate::batch::set_lane(&mut lanes, $l, $value);
        }
        lanes
    }};
}
pub(crate) use tensor_lanes;

// Whole values in, a whole value out: nothing can alias, so the loops become vector instructions.

impl Add for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        lanes!(l => self.0[l] + other.0[l])
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        lanes!(l => self.0[l] * other.0[l])
    }
}

impl Mul<f64> for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        lanes!(l => self.0[l] * factor)
    }
}

/// A 2 × 2 tensor per element.
pub(crate) type TensorLanes = [[Lanes; 2]; 2];

/// The tensor of lane `l`.
#[inline(always)]
pub(crate) fn lane(t: &TensorLanes, l: usize) -> Tensor {
    [[t[0][0].0[l], t[0][1].0[l]], [t[1][0].0[l], t[1][1].0[l]]]
}

#[inline(always)]
pub(crate) fn set_lane(t: &mut TensorLanes, l: usize, value: Tensor) {
    for i in 0..2 {
        for j in 0..2 {
            t[i][j].0[l] = value[i][j];
        }
    }
}

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
    pub(crate) inverse: TensorLanes,
    pub(crate) area: Lanes,
}

impl<const N: usize> Batch<N> {
    fn new(space: &Space, law: Law, members: &[usize]) -> Self {
        let elements = std::array::from_fn(|l| members[l.min(members.len() - 1)]);
        let mut inverse = [[Lanes::ZERO; 2]; 2];
        let mut area = Lanes::ZERO;
        for (l, &element) in elements.iter().enumerate() {
            let (map, det) = inverse_map(space.mesh().corners(element));
            set_lane(&mut inverse, l, map);
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

    /// Nodal values of a displacement-like field, zero if there is none.
    #[inline(always)]
    pub(crate) fn gather_vector(&self, field: Option<&[f64]>) -> [[Lanes; 2]; N] {
        let mut values = [[Lanes::ZERO; 2]; N];
        if let Some(field) = field {
            for (values, nodes) in values.iter_mut().zip(&self.nodes) {
                for l in 0..LANES {
                    values[0].0[l] = field[2 * nodes[l]];
                    values[1].0[l] = field[2 * nodes[l] + 1];
                }
            }
        }
        values
    }

    /// Vertex values of a pressure-like field, zero if there is none.
    #[inline(always)]
    pub(crate) fn gather_scalar(&self, field: Option<&[f64]>) -> [Lanes; 3] {
        let mut values = [Lanes::ZERO; 3];
        if let Some(field) = field {
            for (values, nodes) in values.iter_mut().zip(&self.nodes) {
                for l in 0..LANES {
                    values.0[l] = field[nodes[l]];
                }
            }
        }
        values
    }

    /// Adds element vectors to a displacement-like array.
    #[inline(always)]
    pub(crate) fn scatter_vector(&self, local: &[[Lanes; 2]; N], field: &mut [f64]) {
        for l in 0..self.count {
            for (nodes, values) in self.nodes.iter().zip(local) {
                field[2 * nodes[l]] += values[0].0[l];
                field[2 * nodes[l] + 1] += values[1].0[l];
            }
        }
    }

    /// Adds element vectors to a pressure-like array.
    #[inline(always)]
    pub(crate) fn scatter_scalar(&self, local: &[Lanes; 3], field: &mut [f64]) {
        for l in 0..self.count {
            for (nodes, values) in self.nodes.iter().zip(local) {
                field[nodes[l]] += values.0[l];
            }
        }
    }

    /// ∇u at a quadrature point: the reference gradient times the inverse map.
    #[inline(always)]
    pub(crate) fn gradient(&self, u: &[[Lanes; 2]; N], point: &Point<N>) -> TensorLanes {
        let mut h = [[Lanes::ZERO; 2]; 2];
        for (i, row) in h.iter_mut().enumerate() {
            let mut reference = [Lanes::ZERO; 2];
            for (value, gradient) in u.iter().zip(&point.gradients) {
                reference[0] += value[i] * gradient[0];
                reference[1] += value[i] * gradient[1];
            }
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = reference[0] * self.inverse[0][j] + reference[1] * self.inverse[1][j];
            }
        }
        h
    }

    /// A pressure-like field at a quadrature point.
    #[inline(always)]
    pub(crate) fn interpolate(&self, p: &[Lanes; 3], point: &Point<N>) -> Lanes {
        p[0] * point.psi[0] + p[1] * point.psi[1] + p[2] * point.psi[2]
    }

    /// w T J⁻ᵀ: ready for the product with reference gradients, the quadrature weight included.
    #[inline(always)]
    pub(crate) fn pull_back(&self, point: &Point<N>, tensor: &TensorLanes) -> TensorLanes {
        let weights = self.weights(point);
        let mut out = [[Lanes::ZERO; 2]; 2];
        for (row, tensor) in out.iter_mut().zip(tensor) {
            for (entry, inverse) in row.iter_mut().zip(&self.inverse) {
                *entry = weights * (tensor[0] * inverse[0] + tensor[1] * inverse[1]);
            }
        }
        out
    }

    /// The quadrature weights of a point.
    #[inline(always)]
    pub(crate) fn weights(&self, point: &Point<N>) -> Lanes {
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

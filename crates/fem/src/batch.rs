//! Elements in batches of [`LANES`], laid out for vector instructions.
//!
//! Cast: a [`Batch`] keeps what is known of its elements; a [`Part`] of it is as many elements as a
//! register has lanes, and [`Lanes`] one number for each of these. Every element is computed alone,
//! so results do not depend on the width of the registers, to the last bit.
//!
//! A batch holds elements of one kind. Per element it keeps the inverse of the map (of a curved one
//! at each point) and the
//! measure; shape gradients are kept once per quadrature point in reference coordinates, so a batch
//! moves little memory. Lanes beyond the last element repeat it with measure zero. Note 0002.

use std::ops::Range;

use pulp::Simd;

use crate::element::Barycentric;
use crate::fibres::Fibres;
use crate::kind::{Kind, Ratios};
use crate::lanes::{Array, LANES, Lanes};
use crate::material::three::Axes;
use crate::material::{Law, Real};
use crate::quadrature::Rule;
use crate::space::Space;

/// A quadrature point: weight as a fraction of the element's measure, pressure shape functions
/// (which are the barycentric coordinates), reference gradients of the displacement's.
#[derive(Debug, Clone)]
pub(crate) struct Point<const D: usize, const N: usize, const P: usize> {
    pub(crate) weight: f64,
    pub(crate) psi: [f64; P],
    pub(crate) gradients: [[f64; D]; N],
}

/// Up to [`LANES`] elements of one kind, with `D` coordinates, `N` nodes and `P` pressures.
#[derive(Debug, Clone)]
pub(crate) struct Batch<const D: usize, const N: usize, const P: usize> {
    pub(crate) kind: Kind,
    pub(crate) elements: [usize; LANES],
    /// Elements that count; the others repeat the last with measure zero.
    pub(crate) count: usize,
    pub(crate) nodes: [[usize; LANES]; N],
    pub(crate) pressures: [[usize; LANES]; P],
    /// One for all points of straight elements, one for each of curved ones.
    geometry: Vec<Geometry<D>>,
    /// Fibre and sheet at each point; none for those along the coordinates.
    axes: Vec<[[Array; 3]; 2]>,
}

/// The map of the elements of a batch at a point.
#[derive(Debug, Clone)]
struct Geometry<const D: usize> {
    /// ∂ξ/∂x.
    inverse: [[Array; D]; D],
    /// The measure that the element has if the map is the same everywhere.
    measure: Array,
}

impl<const D: usize> Geometry<D> {
    /// The map at a place; `count` elements have a measure.
    fn new(space: &Space, elements: &[usize; LANES], count: usize, lambda: &[f64]) -> Self {
        let mut inverse = [[Array::ZERO; D]; D];
        let mut measures = Array::ZERO;
        for (l, &element) in elements.iter().enumerate() {
            let (map, measure) = space.map_at::<D>(element, lambda);
            for (row, map) in inverse.iter_mut().zip(map) {
                for (entry, map) in row.iter_mut().zip(map) {
                    entry.0[l] = map;
                }
            }
            if l < count {
                measures.0[l] = measure;
            }
        }
        Self {
            inverse,
            measure: measures,
        }
    }

    /// One register of it.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, part: usize) -> ([[Lanes<S>; D]; D], Lanes<S>) {
        let mut inverse = [[Lanes::zero(simd); D]; D];
        for (row, arrays) in inverse.iter_mut().zip(&self.inverse) {
            for (entry, array) in row.iter_mut().zip(arrays) {
                *entry = Lanes::load(simd, array, part);
            }
        }
        (inverse, Lanes::load(simd, &self.measure, part))
    }
}

impl<const D: usize, const N: usize, const P: usize> Batch<D, N, P> {
    fn new(space: &Space, kind: Kind, members: &[usize], points: &[Point<D, N, P>]) -> Self {
        let elements = std::array::from_fn(|l| members[l.min(members.len() - 1)]);
        let n_maps = if space.is_curved(members[0]) {
            points.len()
        } else {
            1
        };
        let geometry = points[..n_maps]
            .iter()
            .map(|point| Geometry::new(space, &elements, members.len(), &point.psi))
            .collect();
        let nodes = std::array::from_fn(|a| elements.map(|e| space.element_nodes(e)[a]));
        let pressures = std::array::from_fn(|a| elements.map(|e| space.element_pressures(e)[a]));
        Self {
            kind,
            elements,
            count: members.len(),
            nodes,
            pressures,
            geometry,
            axes: Vec::new(),
        }
    }
}

/// The elements of a batch that fit a register.
pub(crate) struct Part<'a, S: Simd, const D: usize, const N: usize, const P: usize> {
    simd: S,
    batch: &'a Batch<D, N, P>,
    /// Its number in the batch.
    number: usize,
    /// The lanes of the batch, those without element included.
    lanes: Range<usize>,
    /// Whether vectors go element by element, see [`Stretch`].
    apart: bool,
    inverse: [[Lanes<S>; D]; D],
    measure: Lanes<S>,
}

impl<const D: usize, const N: usize, const P: usize> Batch<D, N, P> {
    /// Number of parts that have elements.
    #[inline(always)]
    pub(crate) fn n_parts<S: Simd>(&self, _: S) -> usize {
        self.count.div_ceil(S::F64_LANES)
    }

    /// One of the parts.
    #[inline(always)]
    pub(crate) fn part<S: Simd>(&self, simd: S, part: usize) -> Part<'_, S, D, N, P> {
        let (inverse, measure) = self.geometry[0].load(simd, part);
        Part {
            simd,
            batch: self,
            number: part,
            lanes: part * S::F64_LANES..(part + 1) * S::F64_LANES,
            apart: false,
            inverse,
            measure,
        }
    }
}

impl<S: Simd, const D: usize, const N: usize, const P: usize> Part<'_, S, D, N, P> {
    /// The part, with vectors that go element by element or not.
    #[inline(always)]
    pub(crate) fn apart(mut self, apart: bool) -> Self {
        self.apart = apart;
        self
    }

    /// Takes the map of curved elements at a quadrature point; straight ones have it everywhere.
    #[inline(always)]
    pub(crate) fn move_to(&mut self, point: usize) {
        if self.batch.geometry.len() > 1 {
            (self.inverse, self.measure) = self.batch.geometry[point].load(self.simd, self.number);
        }
    }

    #[inline(always)]
    pub(crate) fn zero(&self) -> Lanes<S> {
        Lanes::zero(self.simd)
    }

    /// The axes of the fibres at a point.
    #[inline(always)]
    pub(crate) fn axes(&self, point: usize) -> Axes<Lanes<S>> {
        let mut axes = Axes::cartesian(self.zero());
        if let Some([fibre, sheet]) = self.batch.axes.get(point) {
            for i in 0..3 {
                axes.fibre[i] = Lanes::load(self.simd, &fibre[i], self.number);
                axes.sheet[i] = Lanes::load(self.simd, &sheet[i], self.number);
            }
        }
        axes
    }

    /// The law of the elements.
    #[inline(always)]
    pub(crate) fn law(&self) -> Law {
        self.batch.kind.law
    }

    /// Constants of the elements by those of the body.
    #[inline(always)]
    pub(crate) fn ratios(&self) -> Ratios {
        self.batch.kind.ratios
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
    pub(crate) fn gather_vector(&self, field: Option<&[f64]>) -> [[Lanes<S>; D]; N] {
        let mut values = [[self.zero(); D]; N];
        if let Some(field) = field {
            for (place, values) in values.iter_mut().enumerate() {
                for (lane, &node) in self.nodes(place).iter().enumerate() {
                    let at_node = &field[D * node..][..D];
                    for (value, at_node) in values.iter_mut().zip(at_node) {
                        value.as_mut_slice()[lane] = *at_node;
                    }
                }
            }
        }
        values
    }

    /// Values of a pressure-like field, zero if there is none.
    #[inline(always)]
    pub(crate) fn gather_scalar(&self, field: Option<&[f64]>) -> [Lanes<S>; P] {
        let mut values = [self.zero(); P];
        if let Some(field) = field {
            for (pressures, value) in self.batch.pressures.iter().zip(&mut values) {
                let pressures = &pressures[self.lanes.clone()];
                for (lane, &pressure) in value.as_mut_slice().iter_mut().zip(pressures) {
                    *lane = field[pressure];
                }
            }
        }
        values
    }

    /// Vertex values of the law's factors.
    #[inline(always)]
    pub(crate) fn gather_factors(&self, factors: &[f64]) -> [Lanes<S>; P] {
        let mut values = [self.zero(); P];
        for (vertex, value) in values.iter_mut().enumerate() {
            for (lane, factor) in value.as_mut_slice().iter_mut().enumerate() {
                *factor = factors[P * self.element(lane) + vertex];
            }
        }
        values
    }

    /// Values of the elements; none if all are zero.
    #[inline(always)]
    pub(crate) fn gather_element(&self, field: &[f64]) -> Option<Lanes<S>> {
        let mut values = self.zero();
        let mut any = false;
        for (lane, value) in values.as_mut_slice().iter_mut().enumerate() {
            *value = field[self.element(lane)];
            any |= *value != 0.0;
        }
        any.then_some(values)
    }

    /// Adds element vectors to a displacement-like array.
    #[inline(always)]
    pub(crate) fn scatter_vector(&self, local: &[[Lanes<S>; D]; N], field: &mut [f64]) {
        for (lane, l) in self.occupied().enumerate() {
            for (a, (nodes, values)) in self.batch.nodes.iter().zip(local).enumerate() {
                // Asked in space only, where the loops of large bodies are shared out.
                let node = match D == 3 && self.apart {
                    true => l * N + a,
                    false => nodes[l],
                };
                let entries = &mut field[D * node..][..D];
                for (entry, value) in entries.iter_mut().zip(values) {
                    *entry += value.as_slice()[lane];
                }
            }
        }
    }

    /// Adds element vectors to a pressure-like array.
    #[inline(always)]
    pub(crate) fn scatter_scalar(&self, local: &[Lanes<S>; P], field: &mut [f64]) {
        for (lane, l) in self.occupied().enumerate() {
            for (v, (pressures, values)) in self.batch.pressures.iter().zip(local).enumerate() {
                let vertex = match D == 3 && self.apart {
                    true => l * P + v,
                    false => pressures[l],
                };
                field[vertex] += values.as_slice()[lane];
            }
        }
    }

    /// ∇u at a quadrature point: the reference gradient times the inverse map.
    #[inline(always)]
    pub(crate) fn gradient(
        &self,
        u: &[[Lanes<S>; D]; N],
        point: &Point<D, N, P>,
    ) -> [[Lanes<S>; D]; D] {
        let mut h = [[self.zero(); D]; D];
        for (i, row) in h.iter_mut().enumerate() {
            let mut reference = [self.zero(); D];
            for (value, gradient) in u.iter().zip(&point.gradients) {
                for (sum, &gradient) in reference.iter_mut().zip(gradient) {
                    *sum = value[i].mul_add(sum.like(gradient), *sum);
                }
            }
            for (j, entry) in row.iter_mut().enumerate() {
                let mut column = reference;
                for (along, inverse) in column.iter_mut().zip(&self.inverse) {
                    *along = inverse[j];
                }
                *entry = dot(&reference, &column);
            }
        }
        h
    }

    /// A pressure-like field at a quadrature point.
    #[inline(always)]
    pub(crate) fn interpolate(&self, p: &[Lanes<S>; P], point: &Point<D, N, P>) -> Lanes<S> {
        let mut sum = p[0] * point.psi[0];
        for i in 1..P {
            sum = sum + p[i] * point.psi[i];
        }
        sum
    }

    /// The fibre at a point.
    #[inline(always)]
    pub(crate) fn fibre(&self, point: usize) -> [Lanes<S>; D] {
        let axes = self.axes(point);
        let mut fibre = [self.zero(); D];
        for (fibre, along) in fibre.iter_mut().zip(axes.fibre) {
            *fibre = along;
        }
        fibre
    }

    /// The gradients of the shape functions at a point: the reference ones times the inverse map.
    #[inline(always)]
    pub(crate) fn gradients(&self, point: &Point<D, N, P>) -> [[Lanes<S>; D]; N] {
        let mut gradients = [[self.zero(); D]; N];
        for (gradient, reference) in gradients.iter_mut().zip(&point.gradients) {
            for (j, entry) in gradient.iter_mut().enumerate() {
                for (along, inverse) in reference.iter().zip(&self.inverse) {
                    *entry = inverse[j].mul_add(entry.like(*along), *entry);
                }
            }
        }
        gradients
    }

    /// ∂ξ/∂x.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> &[[Lanes<S>; D]; D] {
        &self.inverse
    }

    /// w T J⁻ᵀ: ready for the product with reference gradients, the quadrature weight included.
    #[inline(always)]
    pub(crate) fn pull_back(
        &self,
        point: &Point<D, N, P>,
        tensor: &[[Lanes<S>; D]; D],
    ) -> [[Lanes<S>; D]; D] {
        let weights = self.weights(point);
        let mut out = [[self.zero(); D]; D];
        for (row, tensor) in out.iter_mut().zip(tensor) {
            for (entry, inverse) in row.iter_mut().zip(&self.inverse) {
                *entry = weights * dot(tensor, inverse);
            }
        }
        out
    }

    /// The quadrature weights of a point.
    #[inline(always)]
    pub(crate) fn weights(&self, point: &Point<D, N, P>) -> Lanes<S> {
        self.measure * point.weight
    }
}

/// Σ a_j b_j, the last product rounded first.
#[inline(always)]
pub(crate) fn dot<R: Real, const D: usize>(a: &[R; D], b: &[R; D]) -> R {
    let mut sum = a[D - 1] * b[D - 1];
    for j in (0..D - 1).rev() {
        sum = a[j].mul_add(b[j], sum);
    }
    sum
}

/// `sum` + Σ a_j g_j for numbers g, the last product added first.
#[inline(always)]
pub(crate) fn add_dot<R: Real, const D: usize>(a: &[R; D], g: &[f64; D], mut sum: R) -> R {
    for j in (0..D).rev() {
        sum = a[j].mul_add(sum.like(g[j]), sum);
    }
    sum
}

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

//! Elements in batches of [`LANES`], laid out for vector instructions.
//!
//! Cast: a [`Batch`] keeps what is known of its elements; a [`Part`] of it is as many elements as a
//! register has lanes, and [`Lanes`](crate::simd::lanes::Lanes) one number for each of these. Every element is computed alone,
//! so results do not depend on the width of the registers, to the last bit.
//!
//! A batch holds elements of one kind. Per element it keeps the inverse of the map (of a curved one
//! at each point) and the measure; shape gradients are kept once per quadrature point in reference
//! coordinates, so a batch moves little memory. Lanes beyond the last element repeat it with measure zero. Note 0002.

mod batches;
mod exchange;
mod geometry;
mod part;
mod sums;

use crate::simd::lanes::{Array, LANES};
use crate::solid::kind::Kind;
use crate::space::Space;
use geometry::Geometry;

pub(crate) use batches::{Batches, Stretch};
pub(crate) use part::Part;
pub(crate) use sums::{add_dot, add_scaled, dot, dot_numbers};

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

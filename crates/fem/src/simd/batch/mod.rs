//! Batches of [`LANES`] elements, whose data layout is suitable for vector instructions.
//!
//! A [`Batch`] stores the data of its elements. A [`Part`] is the part of a batch that fits in a vector register,
//! and [`Lanes`](crate::simd::lanes::Lanes) holds one number for each of its elements. Elements are computed
//! independently, so the results do not depend on the register width and are bitwise equal.
//!
//! A batch holds elements of one material. It stores the inverse map and the measure of each element; for curved
//! elements, it stores them at each quadrature point. Gradients of shape functions are stored in reference
//! coordinates, once per quadrature point, so little memory is transferred per batch. Unused lanes repeat the last
//! element with measure zero. See note 0002.

mod batches;
mod exchange;
mod geometry;
mod part;
mod sums;

use crate::simd::lanes::{Array, LANES};
use crate::solid::element_material::ElementMaterial;
use crate::space::Space;
use geometry::Geometry;

pub(crate) use batches::{BatchRange, Batches};
pub(crate) use part::Part;
pub(crate) use sums::{add_dot, add_scaled, dot, dot_numbers};

/// Quadrature point with its weight (a fraction of the element measure), the pressure shape functions (the
/// barycentric coordinates), and the reference gradients of the displacement shape functions.
#[derive(Debug, Clone)]
pub(crate) struct Point<const D: usize, const N: usize, const P: usize> {
    pub(crate) weight: f64,
    pub(crate) psi: [f64; P],
    pub(crate) gradients: [[f64; D]; N],
}

/// Up to [`LANES`] elements of one material with `D` coordinates, `N` nodes and `P` pressures.
#[derive(Debug, Clone)]
pub(crate) struct Batch<const D: usize, const N: usize, const P: usize> {
    pub(crate) material: ElementMaterial,
    pub(crate) elements: [usize; LANES],
    /// Number of elements. Unused lanes repeat the last element with measure zero.
    pub(crate) count: usize,
    pub(crate) nodes: [[usize; LANES]; N],
    pub(crate) pressures: [[usize; LANES]; P],
    /// One map for straight elements, or one map per quadrature point for curved elements.
    geometry: Vec<Geometry<D>>,
    /// Fiber and sheet directions at each point. The list is empty if the coordinate axes are used.
    axes: Vec<[[Array; 3]; 2]>,
}

impl<const D: usize, const N: usize, const P: usize> Batch<D, N, P> {
    fn new(
        space: &Space,
        material: ElementMaterial,
        members: &[usize],
        points: &[Point<D, N, P>],
    ) -> Self {
        let elements = std::array::from_fn(|l| members[l.min(members.len() - 1)]);
        let n_maps = if space.is_curved(members[0]) { points.len() } else { 1 };
        let geometry = points[..n_maps]
            .iter()
            .map(|point| Geometry::new(space, &elements, members.len(), &point.psi))
            .collect();
        let nodes = std::array::from_fn(|a| elements.map(|e| space.element_nodes(e)[a]));
        let pressures = std::array::from_fn(|a| elements.map(|e| space.element_pressures(e)[a]));
        Self {
            material,
            elements,
            count: members.len(),
            nodes,
            pressures,
            geometry,
            axes: Vec::new(),
        }
    }
}

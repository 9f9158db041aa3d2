//! Rank check of the supports of each part of a body.

use std::collections::BTreeMap;

use myovib_fem::{Space, bounds};
use myovib_structure::{MovingBody, RigidBodies};

use crate::analysis::free_parts::{FreePart, FreeParts};
use crate::error::ModelError;
use crate::muscle::Muscle;

/// Maximum number of parts without common edges (3D: faces) to treat separately. If a mesh has more parts, it
/// is treated as one body, and its hinges are not detected.
const MAX_PARTS: usize = 100;

/// Returns the parts of the body that can move rigidly; `None` without such parts. Compares the rank of the
/// conditions of supports and joints with the rigid motions of each part.
pub fn free_parts(muscle: &Muscle) -> Option<FreeParts> {
    let space = muscle.solid.space();
    let dofs = muscle.solid.dofs();
    let dimension = space.dimension();
    let mut part_of = space.mesh().parts();
    let n_parts = |parts: &[usize]| parts.iter().max().map_or(0, |last| last + 1);
    if n_parts(&part_of) > MAX_PARTS {
        part_of.fill(0);
    }

    let Parts { elements, centers, at_node } = Parts::new(space, &part_of, n_parts(&part_of));
    let mut bodies = RigidBodies::new(dimension, &centers, extent(muscle));
    let mut is_free = vec![false; dofs.n_full()];
    for &component in dofs.free_to_full() {
        is_free[component] = true;
    }
    for (node, parts) in at_node.iter().enumerate() {
        for axis in (0..dimension).filter(|axis| !is_free[dimension * node + axis]) {
            let mut direction = vec![0.0; dimension];
            direction[axis] = 1.0;
            for &part in parts {
                bodies.hold(part, space.node_point(node), &direction);
            }
        }
        for &other in parts.iter().skip(1) {
            bodies.join([parts[0], other], space.node_point(node));
        }
    }
    hold_by_foundations(&mut bodies, muscle, &at_node);
    let found = bodies.free_motions();
    let part = |motions: MovingBody| FreePart {
        elements: elements[motions.body],
        is_all: elements.len() == 1,
        near: centers[motions.body].clone(),
        motions,
    };
    (found.count > 0).then(|| FreeParts {
        count: found.count,
        parts: found.bodies.into_iter().map(part).collect(),
    })
}

/// Parts of a body without common edges (3D: faces).
struct Parts {
    elements: Vec<usize>,
    /// Mean of the element centers of each part.
    centers: Vec<Vec<f64>>,
    at_node: Vec<Vec<usize>>,
}

impl Parts {
    fn new(space: &Space, part_of: &[usize], n_parts: usize) -> Self {
        let mut elements = vec![0_usize; n_parts];
        let mut centers = vec![vec![0.0; space.dimension()]; n_parts];
        let mut at_node: Vec<Vec<usize>> = vec![Vec::new(); space.n_nodes()];
        for (element, &part) in part_of.iter().enumerate() {
            let vertices = space.mesh().element(element);
            elements[part] += 1;
            for &vertex in vertices {
                for (sum, x) in centers[part].iter_mut().zip(space.node_point(vertex)) {
                    *sum += x / vertices.len() as f64;
                }
            }
            for &node in space.element_nodes(element) {
                if !at_node[node].contains(&part) {
                    at_node[node].push(part);
                }
            }
        }
        for (center, n) in centers.iter_mut().zip(&elements) {
            center.iter_mut().for_each(|x| *x /= *n as f64);
        }
        Self { elements, centers, at_node }
    }
}

/// Adds the conditions of elastic foundations with nonzero stiffness to the parts that the foundations hold.
fn hold_by_foundations(bodies: &mut RigidBodies, muscle: &Muscle, parts_at: &[Vec<usize>]) {
    let space = muscle.solid.space();
    let dimension = space.dimension();
    let foundations = muscle.foundations.iter();
    for foundation in foundations.filter(|foundation| foundation.stiffness() > 0.0) {
        // The rows of a node's diagonal block are the directions in which the foundation holds the node.
        let mut rows: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for &(row, column, value) in foundation.operator().entries() {
            if row / dimension == column / dimension {
                let direction = rows.entry(row).or_insert_with(|| vec![0.0; dimension]);
                direction[column % dimension] = value;
            }
        }
        for (row, direction) in &rows {
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            let unit: Vec<f64> = direction.iter().map(|x| x / length).collect();
            for &part in &parts_at[row / dimension] {
                bodies.hold(part, space.node_point(row / dimension), &unit);
            }
        }
    }
}

/// Rejects an insufficiently supported body.
///
/// # Errors
/// Returns [`ModelError::NotHeld`] if parts of the body can move rigidly.
pub(crate) fn expect_held(muscle: &Muscle) -> Result<(), ModelError> {
    free_parts(muscle).map_or(Ok(()), |free| Err(ModelError::NotHeld(free)))
}

/// Returns the largest extent (m) of a body along an axis.
pub fn extent(muscle: &Muscle) -> f64 {
    extents(muscle).into_iter().fold(0.0, f64::max)
}

/// Returns the extents (m) of a body along the axes.
pub(crate) fn extents(muscle: &Muscle) -> Vec<f64> {
    let space = muscle.solid.space();
    let [low, high] = bounds(space.coordinates(), space.dimension());
    low.iter().zip(&high).map(|(low, high)| high - low).collect()
}

//! Pressure on the deformed boundary: a load that turns and stretches with it.

use crate::dofs::CONSTRAINED;
use crate::error::FemError;
use crate::solid::Solid;
use crate::space::{Degree, Space};
use crate::sparsity::place;

/// −∫_group p (cof F N)·φ ds for a pressure p on the deformed group, positive towards the body.
///
/// With a boundary edge as a curve x(s), counter-clockwise around the body, cof F N ds is its
/// tangent x'(s) ds turned by −90°. That is linear in the displacement in the plane, so the load is
/// `p (f0 + G u)`; f0 and G, which is not symmetric, are found once.
///
/// # Shapes
/// Loads and displacements: `2 n_nodes`.
///
/// # Units
/// p in Pa, the load in N/m.
#[derive(Debug, Clone)]
pub struct FollowerPressure {
    /// Of the undeformed boundary under p = 1: component and force.
    reference: Vec<(usize, f64)>,
    /// G over all components: row, column, value.
    tangent: Vec<(usize, usize, f64)>,
    /// G over the free components: place in the displacement pattern, value.
    stiffness: Vec<(usize, f64)>,
}

impl FollowerPressure {
    /// The operator for the edges of `group`.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], [`FemError::WrongGroup`] if the group does not hold edges,
    /// [`FemError::InnerEdge`] for an edge with the body on both sides.
    pub fn new(solid: &Solid, group: &str) -> Result<Self, FemError> {
        let space = solid.space();
        let points = space.node_points();
        let mut reference = Vec::new();
        let mut tangent = Vec::new();
        for &edge in space.mesh().edges(group)? {
            let nodes = space.edge_nodes(counter_clockwise(space, group, edge)?);
            for (&i, of_node) in nodes.iter().zip(couplings(space.degree())) {
                for (&j, c) in nodes.iter().zip(*of_node) {
                    // -c R x_j with R (x, y) = (y, -x).
                    for (row, column, value) in [(0, 1, -c), (1, 0, *c)] {
                        tangent.push((2 * i + row, 2 * j + column, value));
                        reference.push((2 * i + row, value * points[j][column]));
                    }
                }
            }
        }
        let free = solid.dofs().full_to_free();
        let is_free = |component: usize| free[component] != CONSTRAINED;
        let stiffness = tangent
            .iter()
            .filter(|(row, column, _)| is_free(*row) && is_free(*column))
            .map(|&(row, column, value)| {
                let (row, column) = (free[row] as usize, free[column] as usize);
                (place(solid.displacement_pattern(), row, column), value)
            })
            .collect();
        Ok(Self {
            reference,
            tangent,
            stiffness,
        })
    }

    /// `total` += the load of `pressure` at the displacement `u`.
    ///
    /// # Panics
    /// If an array is too short.
    pub fn add_force(&self, pressure: f64, u: &[f64], total: &mut [f64]) {
        for &(row, force) in &self.reference {
            total[row] += pressure * force;
        }
        for &(row, column, value) in &self.tangent {
            total[row] += pressure * value * u[column];
        }
    }

    /// `values` += the derivative of the load by the free components of u.
    ///
    /// # Shapes
    /// `values`: the entries of [`Solid::displacement_pattern`].
    ///
    /// # Panics
    /// If the array is too short.
    pub fn add_stiffness(&self, pressure: f64, values: &mut [f64]) {
        for &(place, value) in &self.stiffness {
            values[place] += pressure * value;
        }
    }
}

/// The edge in the direction in which its triangle has it.
fn counter_clockwise(
    space: &Space,
    group: &str,
    edge @ [a, b]: [usize; 2],
) -> Result<[usize; 2], FemError> {
    let has = |[from, to]: [usize; 2]| {
        let mut triangles = space.mesh().triangles().iter();
        triangles.any(|&[i, j, k]| [[i, j], [j, k], [k, i]].contains(&[from, to]))
    };
    match [has([a, b]), has([b, a])] {
        [true, true] => Err(FemError::InnerEdge {
            group: group.to_owned(),
            edge,
        }),
        [true, false] => Ok([a, b]),
        _ => Ok([b, a]),
    }
}

/// ∫ N_i N_j' ds over an edge: ends, then midpoint.
fn couplings(degree: Degree) -> &'static [&'static [f64]] {
    const SIXTH: f64 = 1.0 / 6.0;
    match degree {
        Degree::One => &[&[-0.5, 0.5], &[-0.5, 0.5]],
        Degree::Two => &[
            &[-0.5, -SIXTH, 4.0 * SIXTH],
            &[SIXTH, 0.5, -4.0 * SIXTH],
            &[-4.0 * SIXTH, 4.0 * SIXTH, 0.0],
        ],
    }
}

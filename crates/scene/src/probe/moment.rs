//! Moments of nodal forces about a point.

use std::iter::Sum;
use std::ops::{Mul, Sub};

use myovib_fem::{Solid, Space};

use super::column::ColumnKind;
use super::kind::{InvalidPlace, Wrong};
use crate::InputError;

/// Moment about a point.
pub(super) const MOMENT: ColumnKind = ColumnKind::new("M", ["N", "N·m"]);

/// Rejects a point whose number of coordinates differs from the dimension of the body.
pub(super) fn check(about: Option<&[f64]>, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
    let dimension = solid.space().dimension();
    match about {
        Some(point) if point.len() != dimension => {
            let error =
                InputError::new(format!("a point in this mesh needs {dimension} coordinates"));
            Err((".about", InvalidPlace::Input(error.found(format!("{point:?}")))))
        }
        _ => Ok(()),
    }
}

/// Undeformed positions of the nodes relative to a point.
pub(super) struct Arms {
    /// Components of all nodes (m).
    undeformed: Vec<f64>,
    dimension: usize,
}

impl Arms {
    pub(super) fn about(point: &[f64], space: &Space) -> Self {
        let components = space.coordinates().iter().zip(point.iter().cycle());
        Self {
            undeformed: components.map(|(x, about)| x - about).collect(),
            dimension: space.dimension(),
        }
    }

    pub(super) fn names(&self) -> impl Iterator<Item = String> {
        MOMENT.components(3).skip(if self.dimension == 2 { 2 } else { 0 })
    }

    /// Returns the moment of the nodal `force` on `nodes` for a body with the displacement `u`.
    pub(super) fn moment<T>(
        &self,
        nodes: impl Iterator<Item = usize> + Clone,
        u: &[f64],
        force: &[T],
    ) -> Vec<T>
    where
        T: Copy + Mul<f64, Output = T> + Sub<Output = T> + Sum,
    {
        self.cross(nodes, |i| self.undeformed[i] + u[i], force)
    }

    /// Returns the sum over `nodes` of `arm` × `force`.
    pub(super) fn cross<T>(
        &self,
        nodes: impl Iterator<Item = usize> + Clone,
        arm: impl Fn(usize) -> f64,
        force: &[T],
    ) -> Vec<T>
    where
        T: Copy + Mul<f64, Output = T> + Sub<Output = T> + Sum,
    {
        let axes: &[[usize; 2]] = match self.dimension {
            2 => &[[0, 1]],
            _ => &[[1, 2], [2, 0], [0, 1]],
        };
        let component = |&[i, j]: &[usize; 2]| {
            let of_node = |node| {
                let [i, j] = [i, j].map(|axis| self.dimension * node + axis);
                force[j] * arm(i) - force[i] * arm(j)
            };
            nodes.clone().map(of_node).sum()
        };
        axes.iter().map(component).collect()
    }
}

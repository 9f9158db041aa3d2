//! Pressures of incompressible bodies that no displacement controls.

use super::Space;
use super::dofs::DofMap;

/// Pressures for which no element that contains them has a free displacement.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HeldPressures {
    /// Vertices whose pressure is set equal to the pressure of another vertex of an element.
    pub tied: Vec<usize>,
    /// Vertices of parts without free components. The pressure at these vertices is undetermined.
    pub undetermined: Vec<usize>,
}

impl Space {
    /// Returns the space with one unknown fewer for each vertex whose elements have no free nodes, for example at
    /// a corner of a clamped surface.
    ///
    /// For κ = ∞, such a pressure does not occur in any equation. It is set equal to another pressure of its
    /// element. The equation of that pressure then constrains the volume of both.
    #[must_use]
    pub fn with_held_pressures_tied(self, dofs: &DofMap) -> (Self, HeldPressures) {
        let (n, dimension) = (self.n_pressures(), self.dimension());
        let is_free = |node: usize| {
            let mut components = dimension * node..dimension * (node + 1);
            components.any(|component| dofs.full_to_free()[component] != super::dofs::CONSTRAINED)
        };
        let mut equal_to: Vec<Option<usize>> = vec![None; n];
        for element in 0..self.n_elements() {
            if self.element_nodes(element).iter().any(|&node| is_free(node)) {
                for &pressure in self.element_pressures(element) {
                    equal_to[pressure] = Some(pressure);
                }
            }
        }
        // Each pass ties the vertices next to a vertex whose pressure is determined.
        loop {
            let mut ties = Vec::new();
            for element in 0..self.n_elements() {
                let own = self.element_pressures(element);
                let known = own.iter().find_map(|&pressure| equal_to[pressure]);
                let open = own.iter().filter(|&&pressure| equal_to[pressure].is_none());
                ties.extend(open.filter_map(|&pressure| Some((pressure, known?))));
            }
            if ties.is_empty() {
                break;
            }
            for (pressure, known) in ties {
                equal_to[pressure].get_or_insert(known);
            }
        }
        let vertices = |wanted: &dyn Fn(usize) -> bool| -> Vec<usize> {
            let pressures = (0..n).filter(|&pressure| wanted(pressure));
            pressures.map(|pressure| self.pressure_vertices[pressure]).collect()
        };
        let held = HeldPressures {
            tied: vertices(&|p| equal_to[p].is_some_and(|other| other != p)),
            undetermined: vertices(&|p| equal_to[p].is_none()),
        };
        let equal_to: Vec<usize> =
            equal_to.iter().enumerate().map(|(p, other)| other.unwrap_or(p)).collect();
        (self.with_equal_pressures(&equal_to), held)
    }

    /// Returns the space with one unknown fewer for each of the `dependent` pressures that shares an element with
    /// an independent pressure. The dependent pressure is set equal to the independent pressure.
    #[must_use]
    pub fn with_pressures_tied(self, dependent: &[usize]) -> Self {
        let mut is_dependent = vec![false; self.n_pressures()];
        for &pressure in dependent {
            is_dependent[pressure] = true;
        }
        let mut equal_to: Vec<usize> = (0..self.n_pressures()).collect();
        for element in 0..self.n_elements() {
            let own = self.element_pressures(element);
            if let Some(&other) = own.iter().find(|&&pressure| !is_dependent[pressure]) {
                for &pressure in own.iter().filter(|&&pressure| is_dependent[pressure]) {
                    equal_to[pressure] = other;
                }
            }
        }
        self.with_equal_pressures(&equal_to)
    }

    /// Returns the space in which each pressure equals the pressure with the index in `equal_to`.
    fn with_equal_pressures(mut self, equal_to: &[usize]) -> Self {
        let mut numbers = vec![0; equal_to.len()];
        let mut vertices = Vec::new();
        for (pressure, _) in
            equal_to.iter().enumerate().filter(|(pressure, other)| pressure == *other)
        {
            numbers[pressure] = vertices.len();
            vertices.push(self.pressure_vertices[pressure]);
        }
        for pressure in &mut self.element_pressures {
            *pressure = numbers[equal_to[*pressure]];
        }
        self.pressure_vertices = vertices;
        self
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::mesh::Mesh;

    /// Returns a cube of five tetrahedra. One tetrahedron is in the middle, and each of the other four contains a
    /// corner of the cube.
    fn cube() -> Mesh {
        let points: Vec<[f64; 3]> =
            (0..8_u8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from)).collect();
        let elements = vec![[0, 1, 2, 4], [3, 2, 1, 7], [5, 1, 4, 7], [6, 4, 2, 7], [1, 2, 4, 7]];
        Mesh::new(points, elements, BTreeMap::new()).unwrap()
    }

    #[test]
    fn a_corner_that_is_held_in_all_nodes_gets_a_neighbors_pressure() {
        let space = Space::taylor_hood(&cube());
        let on_side = |point: &[f64]| point.contains(&0.0);
        let nodes: Vec<usize> =
            (0..space.n_nodes()).filter(|&node| on_side(space.node_point(node))).collect();
        let dofs = DofMap::clamped(&space, &nodes).unwrap();
        let (tied, held) = space.clone().with_held_pressures_tied(&dofs);
        assert_eq!((held.tied, held.undetermined), (vec![0], vec![]));
        assert_eq!(tied.n_pressures(), 7);
        assert!(!tied.pressure_vertices().contains(&0));
        // The pressure at each other vertex is the index of the vertex. The pressures are evaluated in the element
        // at the corner.
        let p: Vec<f64> = tied.pressure_vertices().iter().map(|&v| v as f64).collect();
        let mut own: Vec<f64> = tied.element_pressures(0).iter().map(|&k| p[k]).collect();
        let corner = own.remove(0);
        own.sort_by(f64::total_cmp);
        assert_eq!(own, [1.0, 2.0, 4.0]);
        assert!(own.contains(&corner));

        let all: Vec<usize> = (0..space.n_nodes()).collect();
        let dofs = DofMap::clamped(&space, &all).unwrap();
        let (_, held) = space.clone().with_held_pressures_tied(&dofs);
        assert_eq!((held.tied.len(), held.undetermined.len()), (0, 8));
        let dofs = DofMap::clamped(&space, &[]).unwrap();
        let (_, held) = space.with_held_pressures_tied(&dofs);
        assert_eq!(held, HeldPressures::default());
    }

    #[test]
    fn a_dependent_pressure_equals_an_independent_one_of_its_element() {
        let tied = Space::taylor_hood(&cube()).with_pressures_tied(&[0, 7]);
        assert_eq!(tied.pressure_vertices(), [1, 2, 3, 4, 5, 6]);
        // The first element is [0, 1, 2, 4], and the last element is [1, 2, 4, 7].
        assert_eq!(tied.element_pressures(0), [0, 0, 1, 3]);
        assert_eq!(tied.element_pressures(4), [0, 1, 3, 0]);
    }
}

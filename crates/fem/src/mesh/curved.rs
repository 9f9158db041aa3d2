//! Orientation check of curved elements.

use super::{DEGENERATE, DefectKind, ElementName, Mesh, MeshDefect};
use crate::element::quadrature::Rule;
use crate::element::{Degree, inverse, inverse_map, jacobian};

impl Mesh {
    /// Rejects curved elements whose map has a non-positive determinant at a node or at a point of
    /// any quadrature rule. Straight elements are checked by their measure.
    ///
    /// # Panics
    /// Panics unless `D` is the dimension.
    pub(super) fn check_curved<const D: usize>(&self) -> Result<(), MeshDefect> {
        let shape = self.shape;
        let rules = [Rule::Degree2, Rule::Degree4, Rule::Degree6];
        let points = rules.iter().flat_map(|rule| rule.points(shape));
        let mut samples = shape.nodes(Degree::Two);
        samples.extend(points.map(|point| point.barycentric));
        let gradients: Vec<Vec<[f64; D]>> =
            samples.iter().map(|lambda| shape.gradients(Degree::Two, lambda)).collect();
        for (element, vertices) in self.elements().enumerate() {
            let edges = || self.edges_of(vertices);
            if edges().all(|edge| self.curved_midpoint(edge).is_none()) {
                continue;
            }
            let mut nodes: Vec<[f64; D]> = vertices.iter().map(|&v| self.points()[v]).collect();
            let (_, straight) = inverse_map(&nodes);
            nodes.extend(edges().map(|edge| self.midpoint::<D>(edge)));
            let determinant = |gradients: &[[f64; D]]| inverse(jacobian(&nodes, gradients)).1;
            // The threshold of straight elements: smaller determinants are rounding errors.
            let is_inverted = |gradients: &Vec<[f64; D]>| {
                let is_positive = determinant(gradients) > DEGENERATE * straight;
                !is_positive
            };
            if let Some(at) = gradients.iter().position(is_inverted) {
                let values = shape.values(Degree::Two, &samples[at]);
                let near = (0..D).map(|m| values.iter().zip(&nodes).map(|(n, x)| n * x[m]).sum());
                return Err(MeshDefect {
                    kind: DefectKind::InvertedCurved,
                    elements: vec![ElementName::Index(element)],
                    near: near.collect(),
                });
            }
        }
        Ok(())
    }

    /// Returns the position of the midside node of an edge.
    fn midpoint<const D: usize>(&self, edge: [usize; 2]) -> [f64; D] {
        let [a, b] = edge.map(|v| self.points::<D>()[v]);
        match self.curved_midpoint(edge) {
            Some(position) => std::array::from_fn(|m| position[m]),
            None => std::array::from_fn(|m| 0.5 * (a[m] + b[m])),
        }
    }
}

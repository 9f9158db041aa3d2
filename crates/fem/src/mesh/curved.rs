//! Whether curved elements are the right way round.

use super::{DEGENERATE, DefectKind, ElementName, Mesh, MeshDefect};
use crate::element::quadrature::Rule;
use crate::element::{Degree, inverse, inverse_map, jacobian};

impl Mesh {
    /// Refuses curved elements whose map has no positive determinant at one of the places where it
    /// is evaluated: their nodes, and the points of every quadrature rule. Straight elements have
    /// been checked by their measure.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub(super) fn check_curved<const D: usize>(&self) -> Result<(), MeshDefect> {
        let shape = self.shape;
        let rules = [Rule::Degree2, Rule::Degree4, Rule::Degree6];
        let points = rules.iter().flat_map(|rule| rule.points(shape));
        let mut places = shape.nodes(Degree::Two);
        places.extend(points.map(|point| point.barycentric));
        let gradients: Vec<Vec<[f64; D]>> = places
            .iter()
            .map(|place| shape.gradients(Degree::Two, place))
            .collect();
        for (element, vertices) in self.elements().enumerate() {
            let edges = || self.edges_of(vertices);
            if edges().all(|edge| self.bent_midpoint(edge).is_none()) {
                continue;
            }
            let mut nodes: Vec<[f64; D]> = vertices.iter().map(|&v| self.points()[v]).collect();
            let (_, straight) = inverse_map(&nodes);
            nodes.extend(edges().map(|edge| self.midpoint::<D>(edge)));
            let determinant = |gradients: &[[f64; D]]| inverse(jacobian(&nodes, gradients)).1;
            // As for straight elements, this small a part is nothing but rounding.
            let folded = |gradients: &Vec<[f64; D]>| {
                let right = determinant(gradients) > DEGENERATE * straight;
                !right
            };
            if let Some(at) = gradients.iter().position(folded) {
                let values = shape.values(Degree::Two, &places[at]);
                let near = (0..D).map(|m| values.iter().zip(&nodes).map(|(n, x)| n * x[m]).sum());
                return Err(MeshDefect {
                    kind: DefectKind::Folded,
                    elements: vec![ElementName::Index(element)],
                    near: near.collect(),
                });
            }
        }
        Ok(())
    }

    /// Where the quadratic node of an edge lies.
    fn midpoint<const D: usize>(&self, edge: [usize; 2]) -> [f64; D] {
        let [a, b] = edge.map(|v| self.points::<D>()[v]);
        match self.bent_midpoint(edge) {
            Some(place) => std::array::from_fn(|m| place[m]),
            None => std::array::from_fn(|m| 0.5 * (a[m] + b[m])),
        }
    }
}

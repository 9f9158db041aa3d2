//! Orientation check of curved elements.

use super::{DEGENERATE, DefectKind, ElementName, Mesh, MeshDefect, MeshNote};
use crate::element::quadrature::Rule;
use crate::element::{Degree, inverse, inverse_map, jacobian};

/// Limit below which a note names a curved element as nearly degenerate. The ratio is the determinant of the
/// element's map divided by the determinant for the straight element. It is zero if a midside node is at the
/// quarter point of its edge. An element with the ratio 0.106 inverted under an active tension of eight shear
/// moduli.
pub(super) const NEARLY_DEGENERATE: f64 = 0.2;

impl Mesh {
    /// Rejects curved elements whose map has a non-positive determinant at a node or at a point of any quadrature
    /// rule. Returns a note if a determinant, relative to the straight element, is below [`NEARLY_DEGENERATE`].
    /// For straight elements, the measure is checked instead.
    pub(super) fn check_curved<const D: usize>(&self) -> Result<Option<MeshNote>, MeshDefect> {
        let shape = self.shape;
        let rules = [Rule::Degree2, Rule::Degree4, Rule::Degree6];
        let points = rules.iter().flat_map(|rule| rule.points(shape));
        let mut samples = shape.nodes(Degree::Two);
        samples.extend(points.map(|point| point.barycentric));
        let gradients: Vec<Vec<[f64; D]>> =
            samples.iter().map(|lambda| shape.gradients(Degree::Two, lambda)).collect();
        let (mut n_elements, mut worst) = (0, (NEARLY_DEGENERATE, Vec::new()));
        for (element, vertices) in self.elements().enumerate() {
            if !self.is_curved(vertices) {
                continue;
            }
            let mut nodes: Vec<[f64; D]> = vertices.iter().map(|&v| self.points()[v]).collect();
            let (_, straight) = inverse_map(&nodes);
            nodes.extend(self.edges_of(vertices).map(|edge| self.midpoint::<D>(edge)));
            let ratio =
                |gradients: &Vec<[f64; D]>| inverse(jacobian(&nodes, gradients)).1 / straight;
            let near = |at: usize| -> Vec<f64> {
                let values = shape.values(Degree::Two, &samples[at]);
                (0..D).map(|m| values.iter().zip(&nodes).map(|(n, x)| n * x[m]).sum()).collect()
            };
            let ratios: Vec<f64> = gradients.iter().map(ratio).collect();
            // This is the threshold for straight elements. Smaller determinants are rounding errors.
            let is_positive = |ratio: &f64| *ratio > DEGENERATE; // false for NaN
            if let Some(at) = ratios.iter().position(|ratio| !is_positive(ratio)) {
                return Err(MeshDefect {
                    kind: DefectKind::InvertedCurved,
                    elements: vec![ElementName::Index(element)],
                    near: near(at),
                });
            }
            let smallest = ratios.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
            if let Some((at, &ratio)) = smallest.filter(|(_, ratio)| **ratio < NEARLY_DEGENERATE) {
                n_elements += 1;
                if ratio < worst.0 {
                    worst = (ratio, near(at));
                }
            }
        }
        let (ratio, near) = worst;
        Ok((n_elements > 0).then_some(MeshNote::NearlyDegenerate {
            elements: n_elements,
            ratio,
            near,
        }))
    }

    /// Returns the position of the midside node of an edge.
    pub(super) fn midpoint<const D: usize>(&self, edge: [usize; 2]) -> [f64; D] {
        let [a, b] = edge.map(|v| self.points::<D>()[v]);
        match self.curved_midpoint(edge) {
            Some(position) => std::array::from_fn(|m| position[m]),
            None => std::array::from_fn(|m| 0.5 * (a[m] + b[m])),
        }
    }
}

//! Points of the mesh close to points outside the mesh.

use super::{ElementPoint, Space};
use crate::element::Barycentric;

/// A point of the mesh close to a given point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// The point of the mesh.
    pub at: ElementPoint,
    /// Distance (m) between the two points.
    pub distance: f64,
    /// Distance divided by the size of the element, which is the root of its area or volume.
    pub relative: f64,
}

impl Space {
    /// Returns a point of the mesh close to a given point outside, or `None` if the map of no element can be
    /// inverted there.
    ///
    /// For each element, negative barycentric coordinates of the given point are set to zero. The nearest of the
    /// resulting points is returned. Its distance is an upper bound on the distance from the mesh. For well-shaped
    /// elements, the two distances have the same order of magnitude.
    pub fn near<const D: usize>(&self, point: [f64; D]) -> Option<Near> {
        let candidate = |element: usize| {
            let lambda = match self.curved[element] {
                false => self.barycentric_in(element, point),
                true => self.barycentric_in_curved(element, point)?,
            };
            let inside: Vec<f64> = lambda.iter().map(|l| l.max(0.0)).collect();
            let sum: f64 = inside.iter().sum();
            let inside: Vec<f64> = inside.iter().map(|l| l / sum).collect();
            let at = ElementPoint { element, barycentric: Barycentric::new(&inside) };
            let place = self.position::<D>(&at);
            let squares = place.iter().zip(point).map(|(a, b)| (a - b).powi(2));
            Some((at, squares.sum::<f64>().sqrt()))
        };
        let all = (0..self.n_elements()).filter_map(candidate);
        let (at, distance) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let size = self.mesh.measure_of(at.element).powf(1.0 / D as f64);
        Some(Near { at, distance, relative: distance / size })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate;

    #[test]
    fn the_near_place_is_across_the_boundary() {
        let mesh = generate::rectangle([0.0, 0.0], [2.0, 1.0], [2, 1]).unwrap();
        let space = Space::taylor_hood(&mesh);
        assert!(space.locate([2.01, 0.5]).is_none());
        let near = space.near([2.01, 0.5]).unwrap();
        let place: [f64; 2] = space.position(&near.at);
        assert!((place[0] - 2.0).abs() < 1e-14 && (place[1] - 0.5).abs() < 0.01);
        assert!(near.distance >= 0.01 && near.distance < 0.015);
        // Each unit square has two triangles of area 1/2.
        assert!((near.relative / near.distance - 2f64.sqrt()).abs() < 1e-12);
        let inside = space.near([0.3, 0.4]).unwrap();
        assert!(inside.distance < 1e-15);
    }
}

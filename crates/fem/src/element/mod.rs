//! Reference elements: linear and quadratic triangles and tetrahedra.
//!
//! A [`Shape`] holds the vertices, edges and sides of a simplex. All functions use barycentric coordinates λ, so
//! the same code handles both shapes. The nodes are the vertices, followed (for quadratic elements) by the edge
//! midpoints in the order of [`Shape::edges`]. Gradients are taken with respect to the reference coordinates (λ1,
//! …, λD), with λ0 = 1 − Σ λi.

pub mod quadrature;

use std::fmt;
use std::ops::Deref;

/// Shape of the elements of a mesh.
#[derive(Debug, PartialEq)]
pub struct Shape {
    /// Singular of the name in messages.
    pub name: &'static str,
    /// Plural of the name in messages.
    pub plural: &'static str,
    /// Name of the measure in messages: area or volume.
    pub measure_name: &'static str,
    /// Description in messages of a vertex order for which the measure is negative.
    pub inverted_order: &'static str,
    /// Number of coordinates.
    pub dimension: usize,
    /// End vertices of each edge, in the order of the midpoint nodes.
    pub edges: &'static [[usize; 2]],
    /// Vertices of each side, counterclockwise as seen from outside. The edges of a triangle run
    /// counterclockwise.
    pub sides: &'static [&'static [usize]],
    /// Measure of the reference element. The measure of an element is this value times the
    /// determinant of its map.
    pub reference_measure: f64,
}

/// Triangle.
pub static TRIANGLE: Shape = Shape {
    name: "triangle",
    plural: "triangles",
    measure_name: "area",
    inverted_order: "clockwise",
    dimension: 2,
    edges: &[[0, 1], [1, 2], [2, 0]],
    sides: &[&[0, 1], &[1, 2], &[2, 0]],
    reference_measure: 0.5,
};

/// Tetrahedron, with edges in the order of VTK's quadratic tetrahedron.
pub(crate) static TETRAHEDRON: Shape = Shape {
    name: "tetrahedron",
    plural: "tetrahedra",
    measure_name: "volume",
    inverted_order: "inverted",
    dimension: 3,
    edges: &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
    sides: &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]],
    reference_measure: 1.0 / 6.0,
};

impl Shape {
    /// Returns the simplex of the given dimension.
    ///
    /// # Panics
    /// Panics unless `dimension` is 2 or 3.
    pub(crate) fn of_dimension(dimension: usize) -> &'static Self {
        match dimension {
            2 => &TRIANGLE,
            3 => &TETRAHEDRON,
            other => panic!("no elements of dimension {other}"),
        }
    }

    /// Returns the number of vertices.
    pub fn n_vertices(&self) -> usize {
        self.dimension + 1
    }

    /// Returns the number of displacement nodes.
    pub fn n_nodes(&self, degree: Degree) -> usize {
        match degree {
            Degree::One => self.n_vertices(),
            Degree::Two => self.n_vertices() + self.edges.len(),
        }
    }

    /// Returns the barycentric coordinates of the nodes.
    pub fn nodes(&self, degree: Degree) -> Vec<Barycentric> {
        let vertex = |i: usize| Barycentric::at(self.n_vertices(), &[i]);
        let midpoint = |edge: &[usize; 2]| Barycentric::at(self.n_vertices(), edge);
        let vertices = (0..self.n_vertices()).map(vertex);
        match degree {
            Degree::One => vertices.collect(),
            Degree::Two => vertices.chain(self.edges.iter().map(midpoint)).collect(),
        }
    }

    /// Returns the values of the shape functions at `lambda`. For linear elements, these are λi. For quadratic
    /// elements, they are λi (2 λi − 1) at vertices and 4 λi λj at midpoints.
    pub fn values(&self, degree: Degree, lambda: &[f64]) -> Vec<f64> {
        match degree {
            Degree::One => lambda.to_vec(),
            Degree::Two => {
                let vertices = lambda.iter().map(|l| l * (2.0 * l - 1.0));
                let midpoints = self.edges.iter().map(|&[a, b]| 4.0 * lambda[a] * lambda[b]);
                vertices.chain(midpoints).collect()
            }
        }
    }

    /// Returns the reference gradients of the shape functions at `lambda`.
    ///
    /// # Panics
    /// Panics if `D` is not the dimension of the shape.
    pub fn gradients<const D: usize>(&self, degree: Degree, lambda: &[f64]) -> Vec<[f64; D]> {
        assert_eq!(D, self.dimension);
        match degree {
            Degree::One => (0..=D).map(slopes).collect(),
            Degree::Two => {
                let vertices = (0..=D).map(|i| slopes::<D>(i).map(|s| (4.0 * lambda[i] - 1.0) * s));
                let midpoints = self.edges.iter().map(|&[a, b]| {
                    let (slopes_a, slopes_b) = (slopes::<D>(a), slopes::<D>(b));
                    std::array::from_fn(|m| {
                        4.0 * (lambda[a] * slopes_b[m] + lambda[b] * slopes_a[m])
                    })
                });
                vertices.chain(midpoints).collect()
            }
        }
    }
}

/// Returns the reference gradient of λi.
fn slopes<const D: usize>(i: usize) -> [f64; D] {
    std::array::from_fn(|m| match i {
        0 => -1.0,
        i => f64::from(i == m + 1),
    })
}

/// Degree of the displacement shape functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Degree {
    /// Linear, with nodes at the vertices.
    One,
    /// Quadratic, with nodes at the vertices and edge midpoints.
    Two,
}

/// Barycentric coordinates of a point in an element. There is one coordinate per vertex, and their sum is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barycentric {
    lambda: [f64; 4],
    count: usize,
}

impl Barycentric {
    /// Creates barycentric coordinates from at most four values.
    ///
    /// # Panics
    /// Panics for more than four values.
    pub const fn new(coordinates: &[f64]) -> Self {
        let (mut lambda, count) = ([0.0; 4], coordinates.len());
        let mut i = 0;
        while i < count {
            lambda[i] = coordinates[i];
            i += 1;
        }
        Self { lambda, count }
    }

    /// Returns the mean of the given vertices of a simplex with `count` vertices.
    fn at(count: usize, vertices: &[usize]) -> Self {
        let mut lambda = [0.0; 4];
        for &vertex in vertices {
            lambda[vertex] = 1.0 / vertices.len() as f64;
        }
        Self { lambda, count }
    }

    /// Returns the point with these coordinates in the simplex with the given `vertices`.
    pub(crate) fn point_in<const D: usize>(&self, vertices: &[[f64; D]]) -> [f64; D] {
        std::array::from_fn(|j| self.iter().zip(vertices).map(|(l, x)| l * x[j]).sum())
    }
}

impl<const V: usize> From<[f64; V]> for Barycentric {
    fn from(coordinates: [f64; V]) -> Self {
        Self::new(&coordinates)
    }
}

impl Deref for Barycentric {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.lambda[..self.count]
    }
}

impl fmt::Display for Barycentric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let coordinates: Vec<String> = self.iter().map(|l| format!("{l:.3}")).collect();
        write!(f, "({})", coordinates.join(", "))
    }
}

/// Returns ∂x/∂ξ, given the nodal positions and the reference gradients of the shape functions.
pub(crate) fn jacobian<const D: usize>(
    nodes: &[[f64; D]],
    gradients: &[[f64; D]],
) -> [[f64; D]; D] {
    let mut map = [[0.0; D]; D];
    for (x, gradient) in nodes.iter().zip(gradients) {
        for (row, x) in map.iter_mut().zip(x) {
            for (entry, slope) in row.iter_mut().zip(gradient) {
                *entry += x * slope;
            }
        }
    }
    map
}

/// Returns the inverse and the determinant of the derivative of a map.
pub(crate) fn inverse<const D: usize>(map: [[f64; D]; D]) -> ([[f64; D]; D], f64) {
    let mut inverse = [[0.0; D]; D];
    let det = match D {
        2 => {
            let det = map[0][0] * map[1][1] - map[0][1] * map[1][0];
            inverse[0][0] = map[1][1] / det;
            inverse[0][1] = -map[0][1] / det;
            inverse[1][0] = -map[1][0] / det;
            inverse[1][1] = map[0][0] / det;
            det
        }
        3 => {
            // The cofactor of (i, j). Cyclic indices yield the correct sign.
            let cofactor = |i: usize, j: usize| {
                let ([a, b], [c, d]) = ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]);
                map[a][c] * map[b][d] - map[a][d] * map[b][c]
            };
            let det = (0..3).map(|j| map[0][j] * cofactor(0, j)).sum::<f64>();
            for i in 0..3 {
                for j in 0..3 {
                    inverse[j][i] = cofactor(i, j) / det;
                }
            }
            det
        }
        other => panic!("no elements of dimension {other}"),
    };
    (inverse, det)
}

/// Returns ∂ξ/∂x of a straight-sided element and the determinant of ∂x/∂ξ. The determinant is the ratio of the
/// element's measure to the measure of the reference element.
///
/// # Panics
/// Panics if there are fewer than `D + 1` vertices.
pub fn inverse_map<const D: usize>(vertices: &[[f64; D]]) -> ([[f64; D]; D], f64) {
    let map = std::array::from_fn(|i| std::array::from_fn(|m| vertices[m + 1][i] - vertices[0][i]));
    inverse(map)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [&Shape; 2] = [&TRIANGLE, &TETRAHEDRON];
    const DEGREES: [Degree; 2] = [Degree::One, Degree::Two];

    /// Returns points inside the element and on its boundary.
    fn samples(shape: &Shape) -> Vec<Vec<f64>> {
        match shape.dimension {
            2 => vec![vec![0.2, 0.3, 0.5], vec![0.9, 0.05, 0.05], vec![0.0, 0.4, 0.6]],
            _ => vec![
                vec![0.1, 0.2, 0.3, 0.4],
                vec![0.85, 0.05, 0.07, 0.03],
                vec![0.0, 0.3, 0.1, 0.6],
            ],
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_others() {
        for shape in SHAPES {
            for degree in DEGREES {
                for (a, node) in shape.nodes(degree).iter().enumerate() {
                    for (b, value) in shape.values(degree, node).into_iter().enumerate() {
                        assert_eq!(value, f64::from(a == b), "{} {a} {b}", shape.name);
                    }
                }
            }
        }
    }

    fn gradients(shape: &Shape, degree: Degree, lambda: &[f64]) -> Vec<Vec<f64>> {
        let rows = |row: &[f64]| row.to_vec();
        match shape.dimension {
            2 => shape.gradients::<2>(degree, lambda).iter().map(|g| rows(g)).collect(),
            _ => shape.gradients::<3>(degree, lambda).iter().map(|g| rows(g)).collect(),
        }
    }

    #[test]
    fn shape_functions_sum_to_one_and_gradients_to_zero() {
        for shape in SHAPES {
            for degree in DEGREES {
                for lambda in samples(shape) {
                    let sum: f64 = shape.values(degree, &lambda).iter().sum();
                    assert!((sum - 1.0).abs() < 4.0 * f64::EPSILON);
                    for m in 0..shape.dimension {
                        let gradients = gradients(shape, degree, &lambda);
                        let sum: f64 = gradients.iter().map(|g| g[m]).sum();
                        assert!(sum.abs() < 8.0 * f64::EPSILON);
                    }
                }
            }
        }
    }

    #[test]
    fn gradients_match_central_differences() {
        let h = 1e-3;
        for shape in SHAPES {
            for degree in DEGREES {
                for lambda in samples(shape) {
                    let gradients = gradients(shape, degree, &lambda);
                    for m in 0..shape.dimension {
                        let at = |s: f64| {
                            let mut moved = lambda.clone();
                            moved[0] -= s * h;
                            moved[m + 1] += s * h;
                            shape.values(degree, &moved)
                        };
                        for ((plus, minus), gradient) in
                            at(1.0).iter().zip(at(-1.0)).zip(&gradients)
                        {
                            // Central differences of quadratics are exact up to rounding / h.
                            let slope = (plus - minus) / (2.0 * h);
                            assert!((slope - gradient[m]).abs() < 1e-12);
                        }
                    }
                }
            }
        }
    }

    /// By the divergence theorem for f = x / D, the integral ∮ x·n / D equals the measure if the sides are
    /// oriented outward.
    #[test]
    fn sides_are_oriented_outward() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let flux = |side: &&[usize]| {
            let [a, b] = [corners[side[0]], corners[side[1]]];
            0.5 * (a[0] * b[1] - a[1] * b[0])
        };
        assert_eq!(TRIANGLE.sides.iter().map(flux).sum::<f64>(), TRIANGLE.reference_measure);
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let flux = |side: &&[usize]| {
            let map = [corners[side[0]], corners[side[1]], corners[side[2]]];
            inverse(map).1 / 6.0
        };
        let total = TETRAHEDRON.sides.iter().map(flux).sum::<f64>();
        assert_eq!(total, TETRAHEDRON.reference_measure);
    }

    #[test]
    fn inverse_times_map_is_the_identity() {
        let map = [[1.0, 0.2, -0.3], [0.1, 0.9, 0.4], [-0.2, 0.3, 1.1]];
        let (back, det) = inverse(map);
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| map[i][k] * back[k][j]).sum();
                // The error is a few roundings of numbers of order one.
                assert!((product - f64::from(i == j)).abs() < 8.0 * f64::EPSILON);
            }
        }
        assert!((det - 0.769).abs() < 1e-14);
    }
}

//! Flat tables of triangles or tetrahedra. They allow the same checks for both shapes.

/// Point. In 2D, the third coordinate is 0.
pub(crate) type Point = [f64; 3];

/// Points and elements of a mesh. In d dimensions, an element has d + 1 vertices.
#[derive(Debug, Clone, Copy)]
pub(super) struct Simplices<'a> {
    pub(super) dimension: usize,
    points: &'a [f64],
    vertices: &'a [usize],
}

impl<'a> Simplices<'a> {
    pub(super) fn new(dimension: usize, points: &'a [f64], vertices: &'a [usize]) -> Self {
        Self { dimension, points, vertices }
    }

    pub(super) fn len(&self) -> usize {
        self.vertices.len() / (self.dimension + 1)
    }

    /// Returns the vertices of element `e`.
    pub(super) fn vertices(&self, e: usize) -> &'a [usize] {
        &self.vertices[e * (self.dimension + 1)..][..self.dimension + 1]
    }

    /// Returns the position of vertex `v`.
    pub(super) fn point(&self, v: usize) -> Point {
        let mut point = [0.0; 3];
        point[..self.dimension]
            .copy_from_slice(&self.points[v * self.dimension..][..self.dimension]);
        point
    }

    /// Returns the positions of the vertices of element `e`.
    pub(super) fn corners(&self, e: usize) -> Vec<Point> {
        self.vertices(e).iter().map(|&v| self.point(v)).collect()
    }

    /// Returns the mean position of the given vertices, with as many coordinates as the mesh has dimensions.
    pub(super) fn middle(&self, vertices: &[usize]) -> Vec<f64> {
        let mean = |axis: usize| {
            let sum: f64 = vertices.iter().map(|&v| self.point(v)[axis]).sum();
            sum / vertices.len() as f64
        };
        (0..self.dimension).map(mean).collect()
    }
}

pub(super) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns a normal of an edge in 2D or of a triangle in 3D. The normal is not normalized.
pub(super) fn normal(corners: &[Point]) -> Point {
    match *corners {
        [a, b] => cross(minus(b, a), [0.0, 0.0, 1.0]),
        [a, b, c] => cross(minus(b, a), minus(c, a)),
        _ => unreachable!("a facet of a triangle or of a tetrahedron"),
    }
}

/// Returns the unit normal of a facet of an element that points away from the `inner` vertex of this element.
pub(super) fn outward_normal(corners: &[Point], inner: Point) -> Point {
    let normal = normal(corners);
    let length = dot(normal, normal).sqrt().copysign(-dot(normal, minus(inner, corners[0])));
    normal.map(|n| n / length)
}

/// Returns the largest distance between two of the points.
pub(super) fn diameter(points: &[Point]) -> f64 {
    let mut longest = 0.0_f64;
    for (i, &a) in points.iter().enumerate() {
        for &b in &points[..i] {
            let edge = minus(a, b);
            longest = longest.max(dot(edge, edge));
        }
    }
    longest.sqrt()
}

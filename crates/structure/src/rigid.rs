//! Rigid-body motions that the supports do not prevent.

use std::fmt;

use nalgebra::{DMatrix, RowDVector, Vector3};

use crate::eigen::symmetric_eigen;

/// Singular values below this fraction of the largest singular value indicate a free motion. Lengths are relative
/// to the size of the bodies, so a value is small only if supports nearly coincide or are nearly parallel.
const FREE: f64 = 1e-9;
/// Components of unit motions below this value are printed as zero.
const NAMED: f64 = 1e-6;
/// Number of buffered rows before a QR decomposition compresses them.
const WAITING: usize = 256;

/// Rigid bodies in two or three dimensions, supported and joined at points.
///
/// A small motion of a body with center c is u(x) = t + ω × (x − c). It has three parameters in 2D and six in 3D.
/// A support is a condition n·u(x) = 0 at a point. A joint is the condition u = u' for two bodies.
#[derive(Debug, Clone)]
pub struct RigidBodies {
    dimension: usize,
    centers: Vec<Vector3<f64>>,
    size: f64,
    conditions: DMatrix<f64>,
    waiting: Vec<RowDVector<f64>>,
}

impl RigidBodies {
    /// Creates bodies with the given centers. `size` is the unit of length.
    ///
    /// # Panics
    /// Panics unless the dimension is 2 or 3 and matches the number of coordinates of each center.
    pub fn new(dimension: usize, centers: &[Vec<f64>], size: f64) -> Self {
        assert!(dimension == 2 || dimension == 3, "a body in {dimension} dimensions");
        let n = centers.len() * n_motions(dimension);
        Self {
            dimension,
            centers: centers.iter().map(|c| in_space(c)).collect(),
            size,
            conditions: DMatrix::zeros(0, n),
            waiting: Vec::new(),
        }
    }

    /// Fixes the displacement of `body` along `direction` at the point `place`.
    pub fn hold(&mut self, body: usize, place: &[f64], direction: &[f64]) {
        let row = self.row(body, place, in_space(direction));
        self.add(row);
    }

    /// Joins two bodies at the point `place`.
    pub fn join(&mut self, bodies: [usize; 2], place: &[f64]) {
        for axis in 0..self.dimension {
            let direction = Vector3::ith(axis, 1.0);
            let [one, other] = bodies.map(|body| self.row(body, place, direction));
            self.add(one - other);
        }
    }

    /// Returns n·u(x) as a linear function of the motion parameters.
    fn row(&self, body: usize, place: &[f64], direction: Vector3<f64>) -> RowDVector<f64> {
        let arm = (in_space(place) - self.centers[body]) / self.size;
        let turning = arm.cross(&direction);
        let mut row = RowDVector::zeros(self.conditions.ncols());
        let own = match self.dimension {
            2 => vec![direction.x, direction.y, turning.z],
            _ => [direction, turning].iter().flatten().copied().collect(),
        };
        let start = body * n_motions(self.dimension);
        row.as_mut_slice()[start..start + own.len()].copy_from_slice(&own);
        row
    }

    fn add(&mut self, row: RowDVector<f64>) {
        self.waiting.push(row);
        if self.waiting.len() >= WAITING {
            self.compress();
        }
    }

    /// Compresses the buffered rows to the factor R of a QR decomposition, which has the same kernel.
    fn compress(&mut self) {
        let n = self.conditions.ncols();
        let mut rows: Vec<RowDVector<f64>> = std::mem::take(&mut self.waiting);
        rows.extend(self.conditions.row_iter().map(|row| row.into_owned()));
        self.conditions = DMatrix::zeros(0, n);
        if !rows.is_empty() {
            self.conditions = DMatrix::from_rows(&rows).qr().r();
        }
    }

    /// Returns an orthonormal basis of the motions that satisfy all conditions. The basis vectors are the columns.
    fn kernel(&mut self) -> DMatrix<f64> {
        self.compress();
        let n = self.conditions.ncols();
        // The SVD of a square matrix contains all right singular vectors, including the kernel.
        let rows = n.max(self.conditions.nrows());
        let svd = self.conditions.clone().resize(rows, n, 0.0).svd(false, true);
        let right = svd.v_t.expect("the right singular vectors were computed");
        let largest = svd.singular_values.iter().copied().fold(0.0, f64::max);
        let free: Vec<usize> =
            (0..n).filter(|&i| svd.singular_values[i] <= FREE * largest).collect();
        right.select_rows(&free).transpose()
    }

    /// Returns the bodies that can move, and their motions.
    pub fn free_motions(mut self) -> FreeMotions {
        let kernel = self.kernel();
        if kernel.is_empty() {
            return FreeMotions::default();
        }
        let per_body = n_motions(self.dimension);
        let moving = |body: usize| {
            let own = kernel.rows(body * per_body, per_body).into_owned();
            let motions = self.motions(body, &own);
            (!motions.is_empty()).then_some(MovingBody { body, motions })
        };
        FreeMotions {
            count: kernel.ncols(),
            bodies: (0..self.centers.len()).filter_map(moving).collect(),
        }
    }

    /// Decomposes the motions of one body into slides and turns. The columns span the motions.
    fn motions(&self, body: usize, columns: &DMatrix<f64>) -> Vec<Motion> {
        let n_slides = self.dimension;
        let (shifts, spins) = (columns.rows(0, n_slides), columns.rows_range(n_slides..));
        // Slides have no rotation. Turns are orthogonal to slides.
        let (squares, vectors) = symmetric_eigen(&spins.tr_mul(&spins));
        let mut turns = Vec::new();
        let mut slides = Vec::new();
        for (k, &square) in squares.iter().enumerate() {
            let weights = vectors.column(k);
            let shift = in_space((shifts * weights).as_slice());
            if square > NAMED * NAMED {
                let spin = match self.dimension {
                    2 => Vector3::new(0.0, 0.0, (spins * weights)[0]),
                    _ => in_space((spins * weights).as_slice()),
                };
                // u = t + ω × r is parallel to ω at r = ω × t/ω², the point of the axis closest to the center.
                let arm = spin.cross(&shift) / spin.norm_squared() * self.size;
                turns.push(Motion::Turn {
                    point: self.coordinates(&(self.centers[body] + arm)),
                    axis: (self.dimension == 3).then(|| self.coordinates(&spin.normalize())),
                });
            } else if shift.norm() > NAMED {
                slides.push(shift);
            }
        }
        let mut motions: Vec<Motion> = along_axes(&slides)
            .iter()
            .map(|direction| Motion::Slide { direction: self.coordinates(direction) })
            .collect();
        motions.extend(turns);
        motions
    }

    fn coordinates(&self, vector: &Vector3<f64>) -> Vec<f64> {
        vector.as_slice()[..self.dimension].to_vec()
    }
}

fn n_motions(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

fn in_space(coordinates: &[f64]) -> Vector3<f64> {
    let mut vector = Vector3::zeros();
    vector.as_mut_slice()[..coordinates.len()].copy_from_slice(coordinates);
    vector
}

/// Returns a basis of the span of `vectors` that includes as many coordinate axes as possible.
fn along_axes(vectors: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut left: Vec<Vector3<f64>> = Vec::new();
    let add = |v: &Vector3<f64>, basis: &mut Vec<Vector3<f64>>| {
        let rest = basis.iter().fold(*v, |rest, b| rest - *b * b.dot(&rest));
        if rest.norm() > NAMED * v.norm().max(NAMED) {
            basis.push(rest.normalize());
        }
    };
    vectors.iter().for_each(|v| add(v, &mut left));
    let in_span = |axis: &Vector3<f64>| {
        let part: f64 = left.iter().map(|b| b.dot(axis).powi(2)).sum();
        1.0 - part < NAMED
    };
    let mut basis: Vec<Vector3<f64>> =
        (0..3).map(|k| Vector3::ith(k, 1.0)).filter(in_span).collect();
    left.iter().for_each(|v| add(v, &mut basis));
    basis
}

/// The motions that the supports do not prevent.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FreeMotions {
    /// Number of independent motions of all bodies together.
    pub count: usize,
    /// Bodies that can move.
    pub bodies: Vec<MovingBody>,
}

/// A body that can move.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingBody {
    /// Index of the body.
    pub body: usize,
    /// Motions of the body.
    pub motions: Vec<Motion>,
}

/// One motion of a rigid body.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// A translation along a unit vector.
    Slide {
        /// Direction.
        direction: Vec<f64>,
    },
    /// A rotation about a point in 2D, or about an axis in 3D (possibly combined with a translation along the
    /// axis).
    Turn {
        /// Point on the axis.
        point: Vec<f64>,
        /// Unit vector along the axis in 3D.
        axis: Option<Vec<f64>>,
    },
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slide { direction } => write!(f, "slide in {}", direction_name(direction)),
            Self::Turn { point, axis: None } => write!(f, "turn about {}", place(point)),
            Self::Turn { point, axis: Some(axis) } => {
                write!(f, "turn about {} at {}", direction_name(axis), place(point))
            }
        }
    }
}

impl fmt::Display for MovingBody {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let motions: Vec<String> = self.motions.iter().map(ToString::to_string).collect();
        write!(f, "can {}", motions.join(" and "))
    }
}

/// Returns x, y or z for a coordinate axis, otherwise the components.
fn direction_name(direction: &[f64]) -> String {
    match direction.iter().position(|d| 1.0 - d.abs() < NAMED) {
        Some(axis) => ["x", "y", "z"][axis].to_owned(),
        None => format!("the direction {}", place(direction)),
    }
}

fn place(coordinates: &[f64]) -> String {
    // Rounds to micrometers. Adding zero turns a negative zero into a positive zero.
    let shown = |x: &f64| ((x * 1e6).round() / 1e6 + 0.0).to_string();
    let coordinates: Vec<String> = coordinates.iter().map(shown).collect();
    format!("({})", coordinates.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(bodies: RigidBodies) -> (usize, Vec<String>) {
        let found = bodies.free_motions();
        let words = found.bodies.iter().map(ToString::to_string).collect();
        (found.count, words)
    }

    fn plane() -> RigidBodies {
        RigidBodies::new(2, &[vec![1.0, 2.0]], 3.0)
    }

    fn space() -> RigidBodies {
        RigidBodies::new(3, &[vec![1.0, 2.0, 3.0]], 2.0)
    }

    #[test]
    fn a_free_body_has_three_motions_in_the_plane_and_six_in_space() {
        let (count, found) = words(plane());
        assert_eq!(count, 3);
        assert_eq!(found, ["can slide in x and slide in y and turn about (1, 2)"]);
        assert_eq!(words(space()).0, 6);
    }

    #[test]
    fn rollers_allow_slides() {
        let mut body = plane();
        for y in [0.0, 1.0, 5.0] {
            body.hold(0, &[4.0, y], &[1.0, 0.0]);
        }
        assert_eq!(words(body), (1, vec!["can slide in y".to_owned()]));
        let mut body = space();
        for place in [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]] {
            body.hold(0, &place, &[0.0, 0.0, 1.0]);
        }
        let (count, found) = words(body);
        assert_eq!(count, 3);
        assert!(
            found[0].starts_with("can slide in x and slide in y and turn about z at (1, 2"),
            "{found:?}"
        );
    }

    #[test]
    fn a_pin_allows_a_rotation() {
        let mut body = plane();
        for direction in [[1.0, 0.0], [0.0, 1.0]] {
            body.hold(0, &[-3.0, 0.5], &direction);
        }
        assert_eq!(words(body), (1, vec!["can turn about (-3, 0.5)".to_owned()]));
        let mut body = space();
        for place in [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]] {
            for axis in 0..3 {
                let mut direction = [0.0; 3];
                direction[axis] = 1.0;
                body.hold(0, &place, &direction);
            }
        }
        let (count, found) = words(body);
        assert_eq!(count, 1);
        assert!(found[0].starts_with("can turn about x at (1, 0"), "{found:?}");
    }

    /// A body supported by two rollers slides along their slope.
    #[test]
    fn a_slide_along_a_slope_has_its_direction() {
        let mut body = plane();
        for place in [[0.0, 0.0], [3.0, 4.0]] {
            body.hold(0, &place, &[0.8, -0.6]);
        }
        let found = body.free_motions();
        let [Motion::Slide { direction }] = &found.bodies[0].motions[..] else {
            panic!("{found:?}")
        };
        // The error is the rounding of a few operations.
        assert!(
            (direction[0].abs() - 0.6).abs() < 1e-14 && (direction[1].abs() - 0.8).abs() < 1e-14
        );
    }

    /// A supported body carries another body at a single point, so the other body can swing.
    #[test]
    fn a_joint_is_a_hinge() {
        let mut bodies = RigidBodies::new(2, &[vec![0.0, 0.0], vec![2.0, 0.0]], 2.0);
        for (place, direction) in
            [([-1.0, 0.0], [1.0, 0.0]), ([-1.0, 0.0], [0.0, 1.0]), ([-1.0, 1.0], [1.0, 0.0])]
        {
            bodies.hold(0, &place, &direction);
        }
        let separate = bodies.clone().free_motions();
        assert_eq!((separate.count, separate.bodies.len()), (3, 1));
        bodies.join([0, 1], &[1.0, 0.0]);
        let found = bodies.free_motions();
        assert_eq!((found.count, found.bodies.len()), (1, 1));
        assert_eq!(found.bodies[0].body, 1);
        assert_eq!(found.bodies[0].to_string(), "can turn about (1, 0)");
    }

    #[test]
    fn many_supports_prevent_all_motions() {
        let mut body = space();
        for i in 0..1000 {
            let s = f64::from(i) * 0.01;
            body.hold(0, &[s.cos(), s.sin(), s], &[0.0, 1.0, s]);
            body.hold(0, &[s.cos(), s.sin(), s], &[1.0, 0.0, s]);
        }
        assert_eq!(words(body), (0, Vec::new()));
    }
}

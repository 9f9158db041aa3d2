//! Fiber and sheet directions at points of an element, interpolated from the vertices.

use super::three::Axes;
use crate::error::FemError;
use crate::mesh::simplices::dot;

/// Length below which a vector interpolated between unit vectors is too short, so that the vectors at the vertices
/// are treated as opposed.
const OPPOSED: f64 = 1e-6;

/// Largest out-of-plane component of a unit vector in a plane mesh. Components up to this value are attributed to
/// rounding.
const IN_PLANE: f64 = 1e-10;

/// Axes at a point, and whether the vectors at the vertices are opposed at this point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Directed {
    /// Fiber and sheet direction.
    pub axes: Axes<f64>,
    /// Whether the direction of the nearest vertex is used because the interpolated vector is too
    /// short.
    pub nearest: bool,
}

/// Returns the axes at the point with barycentric coordinates `weights`. Fibers and sheets at the vertices are
/// interpolated as signed vectors and normalized, and s0 is made orthogonal to f0.
///
/// The vectors at the vertices have [unit length](unit_vector). If an interpolated vector is too short, the
/// direction of the nearest vertex is used. Without sheets, or if the sheet of the nearest vertex is parallel to
/// the fiber, s0 is an arbitrary direction orthogonal to f0.
///
/// # Shapes
/// `fibers`, `sheets` and `weights` have one entry per vertex.
pub fn axes_at(fibers: &[[f64; 3]], sheets: Option<&[[f64; 3]]>, weights: &[f64]) -> Directed {
    let nearest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    let nearest = nearest.unwrap_or(0);
    let (fiber, fiber_opposed) = match normalized(interpolated(fibers, weights)) {
        Some(fiber) => (fiber, false),
        None => (normalized(fibers[nearest]).unwrap_or([1.0, 0.0, 0.0]), true),
    };
    let across = |sheet| normalized(less_along(sheet, fiber));
    let (sheet, sheet_opposed) = match sheets {
        None => (any_across(fiber), false),
        Some(sheets) => match across(interpolated(sheets, weights)) {
            Some(sheet) => (sheet, false),
            None => (across(sheets[nearest]).unwrap_or_else(|| any_across(fiber)), true),
        },
    };
    Directed { axes: Axes { fiber, sheet }, nearest: fiber_opposed || sheet_opposed }
}

/// Returns the unit vector in the direction of a nonzero vector.
pub fn unit_vector(vector: [f64; 3]) -> [f64; 3] {
    // The vector is scaled first, because the squares of components of 1e-200 are zero.
    let largest = vector.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let scaled = vector.map(|x| x / largest);
    let length = dot(scaled, scaled).sqrt();
    scaled.map(|x| x / length)
}

/// Checks that a vector of a mesh node is a valid direction.
///
/// # Errors
/// Returns [`FemError::Direction`] if the vector is zero, not finite, or (in 2D) not in the plane.
pub fn check_direction(
    field: &str,
    node: u64,
    vector: [f64; 3],
    dimension: usize,
) -> Result<(), FemError> {
    let problem = if vector.iter().any(|x| !x.is_finite()) {
        "not finite"
    } else if vector == [0.0; 3] {
        "zero"
    } else if dimension == 2 && unit_vector(vector)[2].abs() > IN_PLANE {
        "not in the plane of the mesh"
    } else {
        return Ok(());
    };
    Err(FemError::Direction { field: field.to_owned(), node, vector, problem })
}

fn interpolated(vectors: &[[f64; 3]], weights: &[f64]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (vector, weight) in vectors.iter().zip(weights) {
        for (sum, x) in sum.iter_mut().zip(vector) {
            *sum += weight * x;
        }
    }
    sum
}

/// Returns the normalized vector, or `None` if the vector is too short.
fn normalized(vector: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(vector, vector).sqrt();
    (length >= OPPOSED).then(|| vector.map(|x| x / length))
}

fn less_along(vector: [f64; 3], unit: [f64; 3]) -> [f64; 3] {
    let along = dot(vector, unit);
    [0, 1, 2].map(|i| vector[i] - along * unit[i])
}

/// Returns a unit vector orthogonal to `unit`. It is the coordinate direction least parallel to `unit`, projected
/// onto the orthogonal plane.
fn any_across(unit: [f64; 3]) -> [f64; 3] {
    let least = (0..3).min_by(|&a, &b| unit[a].abs().total_cmp(&unit[b].abs()));
    let mut coordinate = [0.0; 3];
    coordinate[least.unwrap_or(0)] = 1.0;
    let across = less_along(coordinate, unit);
    let length = dot(across, across).sqrt();
    across.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::{FemError, axes_at, check_direction, dot};

    const ALONG: [[f64; 3]; 4] =
        [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0], [0.0, 0.6, 0.8], [1.0, 0.0, 0.0]];
    const ACROSS: [[f64; 3]; 4] =
        [[0.0, 1.0, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.8, -0.6], [0.0, 0.0, 1.0]];

    #[test]
    fn axes_are_orthonormal_and_follow_the_interpolated_vectors() {
        let weights = [0.1, 0.4, 0.3, 0.2];
        let point = axes_at(&ALONG, Some(&ACROSS), &weights);
        let (f, s) = (point.axes.fiber, point.axes.sheet);
        assert!(!point.nearest);
        for (a, b, expected) in [(f, f, 1.0), (s, s, 1.0), (f, s, 0.0)] {
            assert!((dot(a, b) - expected).abs() < 4.0 * f64::EPSILON);
        }
        // The weighted sums are 0.1 + 0.32 + 0.2, 0.24 + 0.18, and 0.24.
        let direction = [0.62, 0.42, 0.24];
        let length = dot(direction, direction).sqrt();
        for (found, expected) in f.iter().zip(direction) {
            assert!((found - expected / length).abs() < 4.0 * f64::EPSILON);
        }
    }

    #[test]
    fn nearest_vertex_is_used_for_opposed_vectors() {
        let fibers = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, 0.8]];
        let point = axes_at(&fibers, None, &[0.5, 0.5, 0.0]);
        assert!(point.nearest);
        assert_eq!(point.axes.fiber[0].abs(), 1.0);
        assert!(dot(point.axes.fiber, point.axes.sheet).abs() < f64::EPSILON);
        let aside = axes_at(&fibers, None, &[0.4, 0.4, 0.2]);
        assert!(!aside.nearest);
        assert!((aside.axes.fiber[1] - 0.6).abs() < 4.0 * f64::EPSILON);
    }

    #[test]
    fn invalid_directions_are_rejected() {
        let problem = |vector, dimension| match check_direction("f0", 17, vector, dimension) {
            Err(FemError::Direction { field, node: 17, problem, .. }) if field == "f0" => problem,
            other => panic!("{other:?} instead of an invalid direction"),
        };
        assert_eq!(problem([0.0; 3], 3), "zero");
        assert_eq!(problem([f64::NAN, 0.0, 0.0], 3), "not finite");
        assert_eq!(problem([1.0, 0.0, 0.5], 2), "not in the plane of the mesh");
        assert!(check_direction("f0", 17, [1.0, 0.0, 0.5], 3).is_ok());
    }
}

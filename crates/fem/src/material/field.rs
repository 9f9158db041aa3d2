//! Directions of fibres at points of an element, from vectors at its vertices.

use super::three::Axes;
use crate::error::FemError;

/// Length of an interpolated vector below which vectors oppose each other.
const OPPOSED: f64 = 1e-6;

/// The axes at one point, and whether the vertices' vectors opposed each other there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Directed {
    /// f0 and s0.
    pub axes: Axes<f64>,
    /// Whether a vector is the nearest vertex's, as the interpolated one was too short.
    pub nearest: bool,
}

/// The axes at the point with barycentric coordinates `weights`: fibres and sheets of the vertices
/// interpolated as signed vectors, normalised, s0 made orthogonal to f0.
///
/// Where an interpolated vector is shorter than 1e-6, the nearest vertex's is taken. Without
/// sheets, or where a sheet is along the fibre at its vertex too, s0 is any direction across f0.
///
/// # Shapes
/// As many fibres, sheets and weights as vertices.
pub fn axes_at(fibres: &[[f64; 3]], sheets: Option<&[[f64; 3]]>, weights: &[f64]) -> Directed {
    let nearest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    let nearest = nearest.unwrap_or(0);
    let (fibre, fibre_opposed) = match normalized(interpolated(fibres, weights)) {
        Some(fibre) => (fibre, false),
        None => (normalized(fibres[nearest]).unwrap_or([1.0, 0.0, 0.0]), true),
    };
    let across = |sheet| normalized(less_along(sheet, fibre));
    let (sheet, sheet_opposed) = match sheets {
        None => (any_across(fibre), false),
        Some(sheets) => match across(interpolated(sheets, weights)) {
            Some(sheet) => (sheet, false),
            None => (
                across(sheets[nearest]).unwrap_or_else(|| any_across(fibre)),
                true,
            ),
        },
    };
    Directed {
        axes: Axes { fibre, sheet },
        nearest: fibre_opposed || sheet_opposed,
    }
}

/// Checks that a vector given at a node of a mesh is a direction.
///
/// # Errors
/// [`FemError::Direction`] for one that is zero or not finite, or leaves the plane of a plane mesh.
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
    } else if dimension == 2 && vector[2] != 0.0 {
        "not in the plane of the mesh"
    } else {
        return Ok(());
    };
    Err(FemError::Direction {
        field: field.to_owned(),
        node,
        vector,
        problem,
    })
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

/// The unit vector, unless the length is below the bound.
fn normalized(vector: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(vector, vector).sqrt();
    (length >= OPPOSED).then(|| vector.map(|x| x / length))
}

fn less_along(vector: [f64; 3], unit: [f64; 3]) -> [f64; 3] {
    let along = dot(vector, unit);
    [0, 1, 2].map(|i| vector[i] - along * unit[i])
}

/// The coordinate direction that is least along the unit vector, made orthogonal to it.
fn any_across(unit: [f64; 3]) -> [f64; 3] {
    let least = (0..3).min_by(|&a, &b| unit[a].abs().total_cmp(&unit[b].abs()));
    let mut coordinate = [0.0; 3];
    coordinate[least.unwrap_or(0)] = 1.0;
    let across = less_along(coordinate, unit);
    let length = dot(across, across).sqrt();
    across.map(|x| x / length)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::{axes_at, check_direction, dot};

    const ALONG: [[f64; 3]; 4] = [
        [1.0, 0.0, 0.0],
        [0.8, 0.6, 0.0],
        [0.0, 0.6, 0.8],
        [1.0, 0.0, 0.0],
    ];
    const ACROSS: [[f64; 3]; 4] = [
        [0.0, 1.0, 0.0],
        [-0.6, 0.8, 0.0],
        [0.0, 0.8, -0.6],
        [0.0, 0.0, 1.0],
    ];

    #[test]
    fn axes_are_orthogonal_unit_vectors_along_the_interpolated_ones() {
        let weights = [0.1, 0.4, 0.3, 0.2];
        let point = axes_at(&ALONG, Some(&ACROSS), &weights);
        let (f, s) = (point.axes.fibre, point.axes.sheet);
        assert!(!point.nearest);
        for (a, b, expected) in [(f, f, 1.0), (s, s, 1.0), (f, s, 0.0)] {
            assert!((dot(a, b) - expected).abs() < 4.0 * f64::EPSILON);
        }
        // 0.1 + 0.32 + 0.2, 0.24 + 0.18, 0.24
        let direction = [0.62, 0.42, 0.24];
        let length = dot(direction, direction).sqrt();
        for (found, expected) in f.iter().zip(direction) {
            assert!((found - expected / length).abs() < 4.0 * f64::EPSILON);
        }
    }

    #[test]
    fn where_vectors_oppose_each_other_the_nearest_vertex_counts() {
        let fibres = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, 0.8]];
        let point = axes_at(&fibres, None, &[0.5, 0.5, 0.0]);
        assert!(point.nearest);
        assert_eq!(point.axes.fibre[0].abs(), 1.0);
        assert!(dot(point.axes.fibre, point.axes.sheet).abs() < f64::EPSILON);
        let aside = axes_at(&fibres, None, &[0.4, 0.4, 0.2]);
        assert!(!aside.nearest);
        assert!((aside.axes.fibre[1] - 0.6).abs() < 4.0 * f64::EPSILON);
    }

    #[test]
    fn a_vector_that_is_no_direction_names_its_node() {
        let message = |vector, dimension| {
            let error = check_direction("f0", 17, vector, dimension).unwrap_err();
            error.to_string()
        };
        assert_eq!(
            message([0.0; 3], 3),
            "the field \"f0\" is zero at node 17: (0, 0, 0)"
        );
        assert!(message([f64::NAN, 0.0, 0.0], 3).contains("not finite at node 17"));
        assert!(message([1.0, 0.0, 0.5], 2).contains("not in the plane of the mesh"));
        assert!(check_direction("f0", 17, [1.0, 0.0, 0.5], 3).is_ok());
    }
}

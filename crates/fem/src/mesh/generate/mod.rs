//! Generators of structured meshes with named groups.
//!
//! Each mesh is the image of a unit square with [columns, rows] cells, or of a unit cube of cells. Each square
//! cell is split along its rising diagonal.

mod muscle;

use std::collections::BTreeMap;
use std::f64::consts::PI;

pub use muscle::muscle;

use crate::error::FemError;
use crate::material::Range;
use crate::mesh::{Group, Mesh};

/// Half the length (m) of the spindle.
const HALF_LENGTH: f64 = 0.1;

/// Image of the unit square, with the edges of its four sides.
struct Structured {
    points: Vec<[f64; 2]>,
    triangles: Vec<[usize; 3]>,
    left: Vec<[usize; 2]>,
    right: Vec<[usize; 2]>,
    bottom: Vec<[usize; 2]>,
    top: Vec<[usize; 2]>,
}

impl Structured {
    fn new([columns, rows]: [usize; 2], map: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        let vertex = |i: usize, j: usize| j * (columns + 1) + i;
        let fraction = |i: usize, n: usize| i as f64 / n.max(1) as f64;
        let indices = (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j)));
        let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        let across = |j: usize| (0..columns).map(|i| [vertex(i, j), vertex(i + 1, j)]).collect();
        let along = |i: usize| (0..rows).map(|j| [vertex(i, j), vertex(i, j + 1)]).collect();
        Self {
            points: indices.map(|(i, j)| map([fraction(i, columns), fraction(j, rows)])).collect(),
            triangles: cells
                .flat_map(|(i, j)| {
                    let (low, high) = (vertex(i, j), vertex(i + 1, j + 1));
                    [[low, vertex(i + 1, j), high], [low, high, vertex(i, j + 1)]]
                })
                .collect(),
            left: along(0),
            right: along(columns),
            bottom: across(0),
            top: across(rows),
        }
    }

    /// Creates the mesh. The group `body` contains all triangles.
    fn mesh<const N: usize>(
        self,
        body: &str,
        groups: [(&str, Group); N],
    ) -> Result<Mesh, FemError> {
        let mut named: BTreeMap<String, Group> =
            groups.map(|(name, group)| (name.to_owned(), group)).into();
        let all = (0..self.triangles.len()).collect();
        named.insert(body.to_owned(), Group::Elements(all));
        Mesh::new(self.points, self.triangles, named)
    }
}

/// Returns an error unless `n` is a positive multiple of `divisor`.
fn multiple(
    name: &'static str,
    n: usize,
    divisor: usize,
    condition: &'static str,
) -> Result<(), FemError> {
    if n > 0 && n.is_multiple_of(divisor) {
        return Ok(());
    }
    Err(FemError::Parameter { name, value: n as f64, condition })
}

/// Interpolates between `a` and `b` with the weights 1 − s and s. The result is exact at both ends.
fn interpolate(a: f64, b: f64, s: f64) -> f64 {
    (1.0 - s) * a + s * b
}

/// Generates a rectangle between two corners with the groups `left`, `right`, `bottom`, `top` and `body`.
///
/// # Errors
/// Returns [`FemError::Parameter`] if the corners are in the wrong order, and an error of [`Mesh::new`] if the
/// number of cells is zero.
pub fn rectangle(
    lower_left: [f64; 2],
    upper_right: [f64; 2],
    cells: [usize; 2],
) -> Result<Mesh, FemError> {
    // A negative size would mirror the mesh, and two negative sizes would exchange the names of its sides.
    Range::Positive.check("width", upper_right[0] - lower_left[0])?;
    Range::Positive.check("height", upper_right[1] - lower_left[1])?;
    let parts = Structured::new(cells, |s| {
        [0, 1].map(|m| interpolate(lower_left[m], upper_right[m], s[m]))
    });
    let groups = [
        ("left", Group::Edges(parts.left.clone())),
        ("right", Group::Edges(parts.right.clone())),
        ("bottom", Group::Edges(parts.bottom.clone())),
        ("top", Group::Edges(parts.top.clone())),
    ];
    parts.mesh("body", groups)
}

/// Generates a block between two corners. Each cell is split into six tetrahedra along one diagonal (Kuhn
/// subdivision). Groups: `left`, `right` (x), `front`, `back` (y), `bottom`, `top` (z), `body`.
///
/// # Errors
/// Returns [`FemError::Parameter`] if the corners are in the wrong order, and an error of [`Mesh::new`] if the
/// number of cells is zero.
pub fn block(lower: [f64; 3], upper: [f64; 3], cells: [usize; 3]) -> Result<Mesh, FemError> {
    for (axis, name) in ["length", "width", "height"].into_iter().enumerate() {
        Range::Positive.check(name, upper[axis] - lower[axis])?;
    }
    spatial(cells, |s| [0, 1, 2].map(|m| interpolate(lower[m], upper[m], s[m])))
}

/// Generates the image of a unit cube of cells under an orientation-preserving map. It has the same groups as a
/// [`block`].
///
/// # Errors
/// Returns an error of [`Mesh::new`] if the number of cells is zero or the map inverts elements.
pub fn spatial(cells: [usize; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> Result<Mesh, FemError> {
    let [nx, ny, nz] = cells;
    let vertex = |[i, j, k]: [usize; 3]| (k * (ny + 1) + j) * (nx + 1) + i;
    let fraction = |i: usize, n: usize| i as f64 / n.max(1) as f64;
    let mut points = Vec::new();
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                points.push(map([fraction(i, nx), fraction(j, ny), fraction(k, nz)]));
            }
        }
    }
    // Axis orders of the paths from the lowest to the highest corner of a cell. For the odd permutations, which
    // are the last three, two vertices are swapped.
    const AXIS_ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];
    let mut elements: Vec<[usize; 4]> = Vec::new();
    let mut sides: [Vec<[usize; 3]>; 6] = Default::default();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                for (number, axes) in AXIS_ORDERS.into_iter().enumerate() {
                    let mut corner = [i, j, k];
                    let mut path = [vertex(corner); 4];
                    for (step, axis) in axes.into_iter().enumerate() {
                        corner[axis] += 1;
                        path[step + 1] = vertex(corner);
                    }
                    // The first three vertices share the coordinate along the axis of the last step. The last
                    // three vertices share the coordinate along the axis of the first step.
                    let [first, _, last] = axes;
                    if [i, j, k][last] == 0 {
                        sides[2 * last].push([path[0], path[1], path[2]]);
                    }
                    if [i, j, k][first] + 1 == cells[first] {
                        sides[2 * first + 1].push([path[1], path[2], path[3]]);
                    }
                    if number >= 3 {
                        path.swap(1, 2);
                    }
                    elements.push(path);
                }
            }
        }
    }
    let names = ["left", "right", "front", "back", "bottom", "top"];
    let faces = sides.map(Group::Faces);
    let mut groups: BTreeMap<String, Group> =
        names.map(str::to_owned).into_iter().zip(faces).collect();
    let all = (0..elements.len()).collect();
    groups.insert("body".to_owned(), Group::Elements(all));
    Mesh::new(points, elements, groups)
}

/// Generates a cantilever [0, length] × [−height/2, height/2] with the groups `fixed` (left end), `load` (right
/// end), `tip` (upper right corner) and `body`.
///
/// # Errors
/// Returns [`FemError::Parameter`] if a length is not positive, and an error of [`Mesh::new`] if the number of
/// cells is zero.
pub fn beam(length: f64, height: f64, cells: [usize; 2]) -> Result<Mesh, FemError> {
    Range::Positive.check("length", length)?;
    Range::Positive.check("height", height)?;
    cantilever(Structured::new(cells, |[s, t]| [length * s, height * (t - 0.5)]))
}

/// Generates Cook's membrane, the trapezoid with the corners (0, 0), (48, 44), (48, 60) and (0, 44). It has the
/// same groups as a [`beam`].
///
/// # Errors
/// Returns an error of [`Mesh::new`] if the number of cells is zero.
pub fn cook(cells: [usize; 2]) -> Result<Mesh, FemError> {
    cantilever(Structured::new(cells, |[s, t]| {
        [48.0 * s, interpolate(interpolate(0.0, 44.0, s), interpolate(44.0, 60.0, s), t)]
    }))
}

fn cantilever(parts: Structured) -> Result<Mesh, FemError> {
    let tip = parts.points.len().saturating_sub(1);
    let groups = [
        ("fixed", Group::Edges(parts.left.clone())),
        ("load", Group::Edges(parts.right.clone())),
        ("tip", Group::Points(vec![tip])),
    ];
    parts.mesh("body", groups)
}

/// Returns half the height (m) of the spindle at x: `0.012 + 0.018 cos²(π x / 0.2)`.
pub(crate) fn spindle_half_height(x: f64) -> f64 {
    0.012 + 0.018 * (PI * x / (2.0 * HALF_LENGTH)).cos().powi(2)
}

/// Returns the derivative of [`spindle_half_height`].
fn spindle_slope(x: f64) -> f64 {
    -0.018 * PI / (2.0 * HALF_LENGTH) * (PI * x / HALF_LENGTH).sin()
}

/// Generates the plane spindle of the muscle. It has the groups of `muscle.msh`: `fixed` (both ends), `load` (top,
/// |x| ≤ 0.02), `muscle`, `origin` (the vertex at (0, 0)).
///
/// # Errors
/// Returns [`FemError::Parameter`] unless the number of columns is a multiple of ten and the number of rows is
/// even. These conditions ensure that the ends of the load and the origin are vertices.
pub fn spindle(cells @ [columns, rows]: [usize; 2]) -> Result<Mesh, FemError> {
    let name = "columns of the spindle";
    multiple(name, columns, 10, "a positive multiple of 10")?;
    multiple("rows of the spindle", rows, 2, "a positive multiple of 2")?;
    let parts = Structured::new(cells, |[s, t]| {
        let x = interpolate(-HALF_LENGTH, HALF_LENGTH, s);
        [x, spindle_half_height(x) * (2.0 * t - 1.0)]
    });
    // The load covers the middle fifth of the length.
    let load = parts.top[2 * columns / 5..3 * columns / 5].to_vec();
    let origin = (rows / 2) * (columns + 1) + columns / 2;
    let groups = [
        ("fixed", Group::Edges([parts.left.clone(), parts.right.clone()].concat())),
        ("load", Group::Edges(load)),
        ("origin", Group::Points(vec![origin])),
    ];
    parts.mesh("muscle", groups)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length(mesh: &Mesh, group: &str) -> f64 {
        mesh.edges(group)
            .unwrap()
            .iter()
            .map(|e| e.map(|v| mesh.points()[v]))
            .map(|[a, b]: [[f64; 2]; 2]| (b[0] - a[0]).hypot(b[1] - a[1]))
            .sum()
    }

    /// Bound on the rounding errors of sums of a few hundred terms.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn areas_and_sides_are_exact() {
        let mesh = rectangle([-1.0, 0.5], [2.0, 2.5], [5, 3]).unwrap();
        assert!((mesh.measure() - 6.0).abs() < ROUNDING);
        assert!((length(&mesh, "left") - 2.0).abs() < ROUNDING);
        assert!((length(&mesh, "top") - 3.0).abs() < ROUNDING);
        let mesh = beam(10.0, 1.0, [20, 2]).unwrap();
        assert!((mesh.measure() - 10.0).abs() < ROUNDING);
        assert!((length(&mesh, "load") - 1.0).abs() < ROUNDING);
        let mesh = cook([4, 4]).unwrap();
        assert!((mesh.measure() - 1440.0).abs() < 1440.0 * ROUNDING);
        assert!((length(&mesh, "load") - 16.0).abs() < 16.0 * ROUNDING);
        assert_eq!(mesh.group("tip").unwrap(), &Group::Points(vec![24]));
        assert_eq!(mesh.points()[24], [48.0, 60.0]);
    }

    #[test]
    fn a_block_has_its_volume_and_sides() {
        let mesh = block([-1.0, 0.0, 0.5], [1.0, 3.0, 1.5], [2, 3, 2]).unwrap();
        assert_eq!((mesh.n_points(), mesh.n_elements()), (36, 72));
        assert!((mesh.measure() - 6.0).abs() < ROUNDING);
        assert!(mesh.notes().is_empty());
        let space = crate::Space::taylor_hood(&mesh);
        let areas = [
            ("left", 3.0),
            ("right", 3.0),
            ("front", 2.0),
            ("back", 2.0),
            ("bottom", 6.0),
            ("top", 6.0),
        ];
        for (side, area) in areas {
            let indices = space.quadrature(side).unwrap();
            let found: f64 = indices.iter().map(|(_, weight)| weight).sum();
            assert!((found - area).abs() < ROUNDING, "{side} {found}");
        }
    }

    #[test]
    fn spindle_groups_match_its_geometry() {
        let mesh = spindle([40, 8]).unwrap();
        let Group::Points(origin) = mesh.group("origin").unwrap() else { panic!("points") };
        // The error is the rounding of -0.1 * 0.5 + 0.1 * 0.5.
        assert!(mesh.points::<2>()[origin[0]].iter().all(|x| x.abs() < 1e-17));
        assert!((length(&mesh, "fixed") - 2.0 * 0.024).abs() < ROUNDING);
        for &[a, b] in mesh.edges("load").unwrap() {
            for v in [a, b] {
                let [x, y] = mesh.points()[v];
                assert!(x.abs() <= 0.02 + ROUNDING && (y - spindle_half_height(x)).abs() < 1e-15);
            }
        }
        // The error of the polygon's area is h² y''/12 per cell, which is below 2e-4 of 4 · 0.021 · 0.1.
        assert!((mesh.measure() / (0.4 * (0.012 + 0.009)) - 1.0).abs() < 2e-4);
    }

    #[test]
    fn invalid_sizes_and_cell_counts_are_rejected() {
        assert!(matches!(rectangle([0.0; 2], [1.0; 2], [0, 2]), Err(FemError::NoElements { .. })));
        let parameter = |result: Result<Mesh, FemError>| match result {
            Err(FemError::Parameter { name, value, .. }) => (name, value),
            other => panic!("{other:?} instead of an invalid parameter"),
        };
        for corner in [[-1.0, 1.0], [-1.0, -1.0]] {
            let found = parameter(rectangle([0.0; 2], corner, [1, 1]));
            assert_eq!(found, ("width", -1.0));
        }
        let (name, value) = parameter(beam(1.0, f64::NAN, [1, 1]));
        assert!(name == "height" && value.is_nan());
        let found = parameter(spindle([12, 2]));
        assert_eq!(found, ("columns of the spindle", 12.0));
    }
}

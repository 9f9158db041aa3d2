//! Structured meshes made in code, each with named groups.
//!
//! All are images of a unit square of cells [columns, rows], each cell cut by its rising diagonal.

mod muscle;

use std::collections::BTreeMap;
use std::f64::consts::PI;

pub use muscle::muscle;

use crate::error::FemError;
use crate::mesh::{Group, Mesh};

/// Half the length of the spindle, m.
const HALF_LENGTH: f64 = 0.1;

/// A mesh in the making: parts of a unit square's image, with the edges of its four sides.
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
        let places = (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j)));
        let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        let across = |j: usize| {
            (0..columns)
                .map(|i| [vertex(i, j), vertex(i + 1, j)])
                .collect()
        };
        let along = |i: usize| {
            (0..rows)
                .map(|j| [vertex(i, j), vertex(i, j + 1)])
                .collect()
        };
        Self {
            points: places
                .map(|(i, j)| map([fraction(i, columns), fraction(j, rows)]))
                .collect(),
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

    /// The finished mesh; `body` names the group of all triangles.
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

/// Refuses what would mirror the mesh: mirrored twice, its sides would change their names.
fn positive(name: &'static str, value: f64) -> Result<(), FemError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    let condition = "positive and finite";
    Err(FemError::Parameter {
        name,
        value,
        condition,
    })
}

/// Refuses a number of cells that is no multiple.
fn multiple(
    name: &'static str,
    n: usize,
    divisor: usize,
    condition: &'static str,
) -> Result<(), FemError> {
    if n > 0 && n.is_multiple_of(divisor) {
        return Ok(());
    }
    Err(FemError::Parameter {
        name,
        value: n as f64,
        condition,
    })
}

/// The mean of `a` and `b` with weights 1 − s and s, exact at both ends.
fn between(a: f64, b: f64, s: f64) -> f64 {
    (1.0 - s) * a + s * b
}

/// A rectangle between two corners; groups `left`, `right`, `bottom`, `top`, `body`.
///
/// # Errors
/// [`FemError::Parameter`] for corners in the wrong order, those of [`Mesh::new`] for no cells.
pub fn rectangle(
    lower_left: [f64; 2],
    upper_right: [f64; 2],
    cells: [usize; 2],
) -> Result<Mesh, FemError> {
    positive("width", upper_right[0] - lower_left[0])?;
    positive("height", upper_right[1] - lower_left[1])?;
    let parts = Structured::new(cells, |place| {
        [0, 1].map(|m| between(lower_left[m], upper_right[m], place[m]))
    });
    let groups = [
        ("left", Group::Edges(parts.left.clone())),
        ("right", Group::Edges(parts.right.clone())),
        ("bottom", Group::Edges(parts.bottom.clone())),
        ("top", Group::Edges(parts.top.clone())),
    ];
    parts.mesh("body", groups)
}

/// A block between two corners: cells cut into six tetrahedra each along one diagonal (Kuhn's);
/// groups `left`, `right` (x), `front`, `back` (y), `bottom`, `top` (z), `body`.
///
/// # Errors
/// [`FemError::Parameter`] for corners in the wrong order, those of [`Mesh::new`] for no cells.
pub fn block(lower: [f64; 3], upper: [f64; 3], cells: [usize; 3]) -> Result<Mesh, FemError> {
    for (axis, name) in ["length", "width", "height"].into_iter().enumerate() {
        positive(name, upper[axis] - lower[axis])?;
    }
    spatial(cells, |place| {
        [0, 1, 2].map(|m| between(lower[m], upper[m], place[m]))
    })
}

/// The image of a unit cube of cells under a map that keeps orientation; groups as for [`block`].
///
/// # Errors
/// Those of [`Mesh::new`], for no cells or a map that folds them.
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
    // The ways from a cell's lowest to its highest corner, odd ones with two vertices exchanged.
    const WAYS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [1, 0, 2],
        [2, 1, 0],
    ];
    let mut elements: Vec<[usize; 4]> = Vec::new();
    let mut sides: [Vec<[usize; 3]>; 6] = Default::default();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                for (number, way) in WAYS.into_iter().enumerate() {
                    let mut corner = [i, j, k];
                    let mut path = [vertex(corner); 4];
                    for (step, axis) in way.into_iter().enumerate() {
                        corner[axis] += 1;
                        path[step + 1] = vertex(corner);
                    }
                    // The first three vertices have the coordinate of the last step in common, the
                    // last three that of the first.
                    let [first, _, last] = way;
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

/// A cantilever [0, length] × [−height/2, height/2]; groups `fixed` (left end), `load` (right end),
/// `tip` (its upper corner), `body`.
///
/// # Errors
/// [`FemError::Parameter`] for lengths that are not positive, those of [`Mesh::new`] for no cells.
pub fn beam(length: f64, height: f64, cells: [usize; 2]) -> Result<Mesh, FemError> {
    positive("length", length)?;
    positive("height", height)?;
    cantilever(Structured::new(cells, |[s, t]| {
        [length * s, height * (t - 0.5)]
    }))
}

/// Cook's membrane, the trapezoid (0, 0), (48, 44), (48, 60), (0, 44); groups as for [`beam`].
///
/// # Errors
/// Those of [`Mesh::new`], for no cells.
pub fn cook(cells: [usize; 2]) -> Result<Mesh, FemError> {
    cantilever(Structured::new(cells, |[s, t]| {
        [
            48.0 * s,
            between(between(0.0, 44.0, s), between(44.0, 60.0, s), t),
        ]
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

/// Half the height of the spindle at x: `0.012 + 0.018 cos²(π x / 0.2)`, m.
pub fn spindle_half_height(x: f64) -> f64 {
    0.012 + 0.018 * (PI * x / (2.0 * HALF_LENGTH)).cos().powi(2)
}

/// The derivative of [`spindle_half_height`].
fn spindle_slope(x: f64) -> f64 {
    -0.018 * PI / (2.0 * HALF_LENGTH) * (PI * x / HALF_LENGTH).sin()
}

/// The muscle's spindle with a structured mesh; groups `fixed` (both ends), `load` (top,
/// |x| ≤ 0.02), `muscle`, `origin` (the vertex at (0, 0)), as in `muscle.msh`.
///
/// # Errors
/// [`FemError::Parameter`] unless the columns are a multiple of ten and the rows even, so that the
/// load's ends and the origin are vertices.
pub fn spindle(cells @ [columns, rows]: [usize; 2]) -> Result<Mesh, FemError> {
    let name = "columns of the spindle";
    multiple(name, columns, 10, "a positive multiple of 10")?;
    multiple("rows of the spindle", rows, 2, "a positive multiple of 2")?;
    let parts = Structured::new(cells, |[s, t]| {
        let x = between(-HALF_LENGTH, HALF_LENGTH, s);
        [x, spindle_half_height(x) * (2.0 * t - 1.0)]
    });
    // Two fifths to three fifths of the length carry the load.
    let load = parts.top[2 * columns / 5..3 * columns / 5].to_vec();
    let origin = (rows / 2) * (columns + 1) + columns / 2;
    let groups = [
        (
            "fixed",
            Group::Edges([parts.left.clone(), parts.right.clone()].concat()),
        ),
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

    /// Rounding of sums of some hundred terms.
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
            let places = space.quadrature(side).unwrap();
            let found: f64 = places.iter().map(|(_, weight)| weight).sum();
            assert!((found - area).abs() < ROUNDING, "{side} {found}");
        }
    }

    #[test]
    fn spindle_has_the_groups_of_the_muscle() {
        let mesh = spindle([40, 8]).unwrap();
        let Group::Points(origin) = mesh.group("origin").unwrap() else {
            panic!("points")
        };
        // The rounding of -0.1 * 0.5 + 0.1 * 0.5.
        assert!(
            mesh.points::<2>()[origin[0]]
                .iter()
                .all(|x| x.abs() < 1e-17)
        );
        assert!((length(&mesh, "fixed") - 2.0 * 0.024).abs() < ROUNDING);
        for &[a, b] in mesh.edges("load").unwrap() {
            for v in [a, b] {
                let [x, y] = mesh.points()[v];
                assert!(x.abs() <= 0.02 + ROUNDING && (y - spindle_half_height(x)).abs() < 1e-15);
            }
        }
        // The polygon loses the arc's curvature, h² y''/12 a cell: under 2e-4 of 4 · 0.021 · 0.1.
        assert!((mesh.measure() / (0.4 * (0.012 + 0.009)) - 1.0).abs() < 2e-4);
    }

    #[test]
    fn sizes_and_numbers_of_cells_are_checked() {
        assert!(matches!(
            rectangle([0.0; 2], [1.0; 2], [0, 2]),
            Err(FemError::NoElements { .. })
        ));
        for corner in [[-1.0, 1.0], [-1.0, -1.0]] {
            let message = rectangle([0.0; 2], corner, [1, 1]).unwrap_err().to_string();
            assert_eq!(message, "width = -1 must be positive and finite");
        }
        let message = beam(1.0, f64::NAN, [1, 1]).unwrap_err().to_string();
        assert_eq!(message, "height = NaN must be positive and finite");
        let message = spindle([12, 2]).unwrap_err().to_string();
        assert_eq!(
            message,
            "columns of the spindle = 12 must be a positive multiple of 10"
        );
    }
}

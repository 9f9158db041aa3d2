//! Structured meshes made in code, each with named groups.

use std::collections::BTreeMap;

use crate::error::FemError;
use crate::mesh::{Group, Mesh};

/// A unit square of cells [columns, rows], each cut from its lower left to its upper right corner,
/// mapped by `map`; groups `left`, `right`, `bottom`, `top` (edges) and `body` (triangles).
fn structured(
    [columns, rows]: [usize; 2],
    map: impl Fn([f64; 2]) -> [f64; 2],
) -> Result<Mesh, FemError> {
    let vertex = |i: usize, j: usize| j * (columns + 1) + i;
    let mut points = Vec::new();
    for j in 0..=rows {
        for i in 0..=columns {
            points.push(map([
                i as f64 / columns.max(1) as f64,
                j as f64 / rows.max(1) as f64,
            ]));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let (a, b, c, d) = (
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            );
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
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
    let body = (0..triangles.len()).collect();
    let groups = BTreeMap::from([
        ("bottom".to_owned(), Group::Edges(across(0))),
        ("top".to_owned(), Group::Edges(across(rows))),
        ("left".to_owned(), Group::Edges(along(0))),
        ("right".to_owned(), Group::Edges(along(columns))),
        ("body".to_owned(), Group::Triangles(body)),
    ]);
    Mesh::new(points, triangles, groups)
}

/// A rectangle between two corners, cut into [columns, rows] cells and these by their rising
/// diagonals; groups `left`, `right`, `bottom`, `top`, `body`.
///
/// # Errors
/// Those of [`Mesh::new`], for corners in the wrong order or no cells.
pub fn rectangle(
    lower_left: [f64; 2],
    upper_right: [f64; 2],
    cells: [usize; 2],
) -> Result<Mesh, FemError> {
    let place = |s: f64, m: usize| (1.0 - s) * lower_left[m] + s * upper_right[m];
    structured(cells, |[s, t]| [place(s, 0), place(t, 1)])
}

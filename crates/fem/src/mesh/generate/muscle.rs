//! Three-dimensional muscle with tendons at its ends and fibers along its length.

use std::collections::BTreeMap;

use super::{HALF_LENGTH, interpolate, multiple, spatial, spindle_half_height, spindle_slope};
use crate::error::FemError;
use crate::mesh::{Group, Mesh, NodalField};

/// Rounding of the corners of the square cross-section. A value of 1/2 would produce a circle, whose corner
/// elements would be almost flat.
const ROUNDING: f64 = 0.35;
/// Length of the tendon at each end, as a fraction of the total length.
const TENDON: f64 = 0.1;

/// Generates the three-dimensional spindle of the muscle. Its cross-sections are squares with rounded corners.
/// They have the same half height as the plane spindle.
///
/// Groups: `fixed` (both ends), `left`, `right`, `surface` (the boundary between the ends), `load` (top, |x| ≤
/// 0.02), `muscle`, `tendon` (a tenth of the length at each end), `origin` (the vertex at (0, 0, 0)). The nodal
/// field `fiber` follows the shape of the muscle.
///
/// # Errors
/// Returns [`FemError::Parameter`] unless the number of cells along the muscle is a multiple of ten and the
/// numbers across are even. These conditions ensure that the origin and the ends of the load and of the tendons
/// are vertices.
pub fn muscle(cells: [usize; 3]) -> Result<Mesh, FemError> {
    let along = "cells along the muscle";
    multiple(along, cells[0], 10, "a positive multiple of 10")?;
    for n in &cells[1..] {
        multiple("cells across the muscle", *n, 2, "a positive multiple of 2")?;
    }
    let mesh = spatial(cells, |[s, t, w]| {
        let x = interpolate(-HALF_LENGTH, HALF_LENGTH, s);
        let (r, [a, b]) = (spindle_half_height(x), [t, w].map(|t| 2.0 * t - 1.0));
        let rounded = |a: f64, b: f64| r * a * (1.0 - ROUNDING * b * b).sqrt();
        [x, rounded(a, b), rounded(b, a)]
    })?;
    let points = mesh.points::<3>();
    let [left, right, top] = ["left", "right", "top"].map(|name| faces(&mesh, name));
    let sides = ["front", "back", "bottom", "top"].map(|name| faces(&mesh, name));
    // The limit is half a cell beyond the end of the load, so that rounding does not matter.
    let near = 0.2 * HALF_LENGTH + HALF_LENGTH / cells[0] as f64;
    let mut load = top;
    load.retain(|face| face.iter().all(|&v| points[v][0].abs() < near));
    let end_of_muscle = HALF_LENGTH * (1.0 - 2.0 * TENDON);
    let is_tendon = |element: &usize| {
        let vertices = mesh.element(*element);
        let x: f64 = vertices.iter().map(|&v| points[v][0]).sum();
        x.abs() > end_of_muscle * vertices.len() as f64
    };
    let (tendon, muscle) = (0..mesh.n_elements()).partition(is_tendon);
    let [nx, ny, nz] = cells;
    let origin = (nz / 2 * (ny + 1) + ny / 2) * (nx + 1) + nx / 2;
    let groups = [
        ("fixed", Group::Faces([&left[..], &right].concat())),
        ("left", Group::Faces(left)),
        ("right", Group::Faces(right)),
        ("surface", Group::Faces(sides.concat())),
        ("load", Group::Faces(load)),
        ("tendon", Group::Elements(tendon)),
        ("muscle", Group::Elements(muscle)),
        ("origin", Group::Points(vec![origin])),
    ];
    // The derivative of the map along the muscle, where y and z scale with the half height.
    let along = points.iter().flat_map(|&[x, y, z]| {
        let growth = spindle_slope(x) / spindle_half_height(x);
        [1.0, growth * y, growth * z]
    });
    let field = NodalField { components: 3, values: along.collect() };
    let named = groups.map(|(name, group)| (name.to_owned(), group));
    mesh.with_groups(named.into())?.with_fields(BTreeMap::from([("fiber".to_owned(), field)]))
}

fn faces(mesh: &Mesh, name: &str) -> Vec<[usize; 3]> {
    match mesh.groups().get(name) {
        Some(Group::Faces(faces)) => faces.clone(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Fibers, Space};

    #[test]
    fn groups_and_fibers_match_the_geometry() {
        let mesh = muscle([20, 4, 4]).unwrap();
        assert!(mesh.notes().is_empty(), "{:?}", mesh.notes());
        let Group::Points(origin) = mesh.group("origin").unwrap() else { panic!("points") };
        let points = mesh.points::<3>();
        // The error is the rounding of -0.1 * 0.5 + 0.1 * 0.5.
        assert!(points[origin[0]].iter().all(|x| x.abs() < 1e-17));
        let members = |name: &str| match mesh.group(name).unwrap() {
            Group::Elements(members) => members.len(),
            _ => panic!("elements"),
        };
        // Four of the twenty layers are tendon, and each cell has six tetrahedra.
        assert_eq!((members("tendon"), members("muscle")), (4 * 96, 16 * 96));
        let load = faces(&mesh, "load");
        assert_eq!(load.len(), 4 * 4 * 2);
        let space = Space::taylor_hood(&mesh);
        // Number of displacement and pressure unknowns.
        assert_eq!(space.n_components() + space.n_pressures(), 10_488);
        // On the top side, the fiber field is tangential, so it equals the central difference between neighboring
        // vertices.
        let mut fibers = Fibers::new(&mesh);
        let all: Vec<usize> = (0..mesh.n_elements()).collect();
        fibers.set_nodal(&mesh, &all, "fiber", None).unwrap();
        let on_top: Vec<usize> = (0..21).map(|i| (4 * 5 + 2) * 21 + i).collect();
        let field = mesh.field("fiber").unwrap();
        for v in on_top.windows(3) {
            let [before, fiber, after] =
                [points[v[0]], field.at(v[1]).try_into().unwrap(), points[v[2]]];
            let slope = (after[2] - before[2]) / (after[0] - before[0]);
            let fiber: [f64; 3] = fiber;
            // The error is h²/6 z''', where z''' is below 0.009 (π/0.1)³ = 280 1/m².
            assert!((fiber[2] / fiber[0] - slope).abs() < 0.01_f64.powi(2) / 6.0 * 280.0);
        }
    }

    #[test]
    fn invalid_cell_counts_are_rejected() {
        for (cells, name, value) in [
            ([12, 2, 2], "cells along the muscle", 12.0),
            ([10, 2, 3], "cells across the muscle", 3.0),
        ] {
            assert!(matches!(
                muscle(cells),
                Err(FemError::Parameter { name: n, value: v, .. }) if n == name && v == value
            ));
        }
    }
}

//! The muscle in space, with tendons at its ends and fibres along it.

use std::collections::BTreeMap;

use super::{HALF_LENGTH, between, multiple, spatial, spindle_half_height, spindle_slope};
use crate::error::FemError;
use crate::mesh::{Group, Mesh, NodalField};

/// How much of a square's corners is rounded off: 1/2 makes a circle, whose corner elements would
/// be almost flat.
const ROUNDING: f64 = 0.35;
/// The tendons' part of the length, at either end.
const TENDON: f64 = 0.1;

/// The muscle's spindle in space: its cross-sections are squares with rounded corners, of the
/// [half height](spindle_half_height) of the plane one.
///
/// Groups: `fixed` (both ends), `left`, `right`, `surface` (what lies between), `load` (top,
/// |x| ≤ 0.02), `muscle`, `tendon` (a tenth of the length at either end), `origin` (the vertex at
/// (0, 0, 0)). The nodal field `fibre` is along the muscle.
///
/// # Errors
/// [`FemError::Parameter`] unless the cells along are a multiple of ten and those across even, so that
/// the load's and the tendons' ends and the origin are vertices.
pub fn muscle(cells: [usize; 3]) -> Result<Mesh, FemError> {
    let along = "cells along the muscle";
    multiple(along, cells[0], 10, "a positive multiple of 10")?;
    for n in &cells[1..] {
        multiple("cells across the muscle", *n, 2, "a positive multiple of 2")?;
    }
    let mesh = spatial(cells, |[s, t, w]| {
        let x = between(-HALF_LENGTH, HALF_LENGTH, s);
        let (r, [a, b]) = (spindle_half_height(x), [t, w].map(|t| 2.0 * t - 1.0));
        let rounded = |a: f64, b: f64| r * a * (1.0 - ROUNDING * b * b).sqrt();
        [x, rounded(a, b), rounded(b, a)]
    })?;
    let points = mesh.points::<3>();
    let [left, right, top] = ["left", "right", "top"].map(|name| faces(&mesh, name));
    let sides = ["front", "back", "bottom", "top"].map(|name| faces(&mesh, name));
    // Half a cell beyond its end, so that rounding decides nothing.
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
    // The derivative of the map along the muscle: y and z grow as the half height.
    let along = points.iter().flat_map(|&[x, y, z]| {
        let growth = spindle_slope(x) / spindle_half_height(x);
        [1.0, growth * y, growth * z]
    });
    let field = NodalField {
        components: 3,
        values: along.collect(),
    };
    let named = groups.map(|(name, group)| (name.to_owned(), group));
    mesh.with_groups(named.into())?
        .with_fields(BTreeMap::from([("fibre".to_owned(), field)]))
}

/// The faces of a side.
fn faces(mesh: &Mesh, name: &str) -> Vec<[usize; 3]> {
    match mesh.groups().get(name) {
        Some(Group::Faces(faces)) => faces.clone(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Fibres, Space};

    #[test]
    fn the_muscle_has_its_groups_and_fibres_along_its_sides() {
        let mesh = muscle([20, 4, 4]).unwrap();
        assert!(mesh.notes().is_empty(), "{:?}", mesh.notes());
        let Group::Points(origin) = mesh.group("origin").unwrap() else {
            panic!("points")
        };
        let points = mesh.points::<3>();
        // The rounding of -0.1 * 0.5 + 0.1 * 0.5.
        assert!(points[origin[0]].iter().all(|x| x.abs() < 1e-17));
        let members = |name: &str| match mesh.group(name).unwrap() {
            Group::Elements(members) => members.len(),
            _ => panic!("elements"),
        };
        // Four of the twenty layers are tendon; six tetrahedra a cell.
        assert_eq!((members("tendon"), members("muscle")), (4 * 96, 16 * 96));
        let load = faces(&mesh, "load");
        assert_eq!(load.len(), 4 * 4 * 2);
        let space = Space::taylor_hood(&mesh);
        // u and p.
        assert_eq!(space.n_components() + space.n_pressures(), 10_488);
        // The field at a vertex of the top is the difference of its neighbours along the muscle.
        let mut fibres = Fibres::new(&mesh);
        let all: Vec<usize> = (0..mesh.n_elements()).collect();
        fibres.set_nodal(&mesh, &all, "fibre", None).unwrap();
        let on_top: Vec<usize> = (0..21).map(|i| (4 * 5 + 2) * 21 + i).collect();
        let field = mesh.field("fibre").unwrap();
        for v in on_top.windows(3) {
            let [before, at, after] = [
                points[v[0]],
                field.at(v[1]).try_into().unwrap(),
                points[v[2]],
            ];
            let slope = (after[2] - before[2]) / (after[0] - before[0]);
            let at: [f64; 3] = at;
            // h²/6 z''' with z''' below 0.009 (π/0.1)³ = 280 1/m².
            assert!((at[2] / at[0] - slope).abs() < 0.01_f64.powi(2) / 6.0 * 280.0);
        }
    }

    #[test]
    fn numbers_of_cells_are_checked() {
        for (cells, message) in [
            (
                [12, 2, 2],
                "cells along the muscle = 12 must be a positive multiple of 10",
            ),
            (
                [10, 2, 3],
                "cells across the muscle = 3 must be a positive multiple of 2",
            ),
        ] {
            assert_eq!(muscle(cells).unwrap_err().to_string(), message);
        }
    }
}

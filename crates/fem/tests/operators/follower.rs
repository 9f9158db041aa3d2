//! Tests of exact identities of the follower pressure.

use std::sync::Arc;

use myovib_fem::{
    DofMap, FemError, FollowerPressure, Group, Mesh, Solid, Space, SurfaceOperator, generate, load,
};

use crate::common::{DENSITY, MUSCLE_LAW, dense, random};

const SIDES: [&str; 4] = ["left", "right", "bottom", "top"];

fn free_block() -> Solid {
    let mesh = generate::rectangle([0.0; 2], [2.0, 1.0], [3, 2]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[]).unwrap();
    Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY).unwrap()
}

fn force(solid: &Solid, groups: &[&str], pressure: f64, u: &[f64]) -> Vec<f64> {
    let mut total = vec![0.0; u.len()];
    for group in groups {
        let operator = FollowerPressure::new(solid, group).unwrap();
        operator.add_force(pressure, u, &mut total);
    }
    total
}

#[test]
fn closed_boundary_has_zero_resultant_and_moment() {
    let solid = free_block();
    let points = solid.space().node_points::<2>();
    let u = random(2 * points.len(), 0.1, 3);
    let force = force(&solid, &SIDES, 7.0, &u);
    let (mut resultant, mut moment, mut size) = ([0.0; 2], 0.0, 0.0);
    for (node, x) in points.iter().enumerate() {
        let f = [force[2 * node], force[2 * node + 1]];
        let position = [x[0] + u[2 * node], x[1] + u[2 * node + 1]];
        resultant = [resultant[0] + f[0], resultant[1] + f[1]];
        moment += position[0] * f[1] - position[1] * f[0];
        size += f[0].hypot(f[1]);
    }
    // The error is the rounding of about sixty forces, which are at most 2 m from the origin. The force on one
    // side alone is at least 7 N/m.
    assert!(size > 28.0, "{size}");
    let allowed = 64.0 * f64::EPSILON * size;
    assert!(resultant[0].hypot(resultant[1]) < allowed, "{resultant:?}");
    assert!(moment.abs() < 2.0 * allowed, "{moment:e}");
}

/// For a homogeneous deformation x = F X, the load equals the dead traction −p cof F N.
#[test]
fn homogeneous_deformation_gives_a_dead_traction() {
    let solid = free_block();
    let f = [[1.2, 0.3], [-0.1, 0.9]];
    let points = solid.space().node_points::<2>().iter();
    let u: Vec<f64> =
        points.flat_map(|x| [0, 1].map(|i| f[i][0] * x[0] + f[i][1] * x[1] - x[i])).collect();
    let cof = [[f[1][1], -f[1][0]], [-f[0][1], f[0][0]]];
    let normals = [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]];
    for (group, n) in SIDES.into_iter().zip(normals) {
        let traction = cof.map(|row| -5.0 * (row[0] * n[0] + row[1] * n[1]));
        let expected = load::traction(solid.space(), group, traction).unwrap();
        let force = force(&solid, &[group], 5.0, &u);
        for (force, expected) in force.iter().zip(&expected) {
            // The error is a few roundings of numbers of order 5.
            assert!((force - expected).abs() < 1e-14, "{group}: {force} {expected}");
        }
    }
}

#[test]
fn stiffness_is_the_derivative_of_the_load() {
    let solid = free_block();
    let n = solid.dofs().n_full();
    let (u, d) = (random(n, 0.1, 5), random(n, 0.1, 6));
    let moved: Vec<f64> = u.iter().zip(&d).map(|(u, d)| u + d).collect();
    let (before, after) = (force(&solid, &SIDES, 3.0, &u), force(&solid, &SIDES, 3.0, &moved));
    let mut values = vec![0.0; solid.displacement_pattern().nnz()];
    for group in SIDES {
        let operator = FollowerPressure::new(&solid, group).unwrap();
        operator.add_stiffness(3.0, &u, &mut values);
    }
    let matrix = dense(solid.displacement_pattern(), &values);
    for (row, (before, after)) in before.iter().zip(&after).enumerate() {
        let product: f64 = (0..n).map(|j| matrix[(row, j)] * d[j]).sum();
        // In 2D, the load is linear in u, so the error is the rounding of forces below 3.
        assert!((after - before - product).abs() < 1e-14, "row {row}");
    }
}

#[test]
fn interior_edges_are_rejected() {
    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let diagonal = Group::Edges(vec![[0, 2]]);
    let groups = [("diagonal".to_owned(), diagonal)].into();
    let mesh = Mesh::new(points, vec![[0, 1, 2], [0, 2, 3]], groups).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[]).unwrap();
    let solid = Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY).unwrap();
    let error = FollowerPressure::new(&solid, "diagonal").unwrap_err();
    assert!(
        matches!(&error, FemError::InteriorFacet { vertices, .. } if *vertices == [0, 2]),
        "{error}"
    );
}

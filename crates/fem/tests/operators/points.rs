//! Tests of the Mooney–Rivlin law at points, compared with 30-digit values from an independent program.

use myovib_fem::{Law, Space, generate};
use serde_json::Value;

use crate::common::{Equilibrium, clamped, equilibrium, reference};

/// Rounding error of about twenty operations on numbers of the order of the modulus, 1e4.
const ROUNDING: f64 = 1e-10;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| value.as_str().unwrap().parse().unwrap())
}

fn law(table: &Value) -> Law {
    Law::MooneyRivlin { c10: number(&table["c10"]), c01: number(&table["c01"]) }
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < ROUNDING, "{found} {expected}");
}

#[test]
fn stress_and_energy_match_30_digit_values() {
    let table = reference("s7_mooney_rivlin_point.json");
    let law = law(&table);
    let points = table["points"].as_array().unwrap();
    assert_eq!(points.len(), 4);
    for point in points {
        let f = |i: usize, j: usize| number(&point["F"][i][j]);
        let h = [[f(0, 0) - 1.0, f(0, 1)], [f(1, 0), f(1, 1) - 1.0]];
        let p = number(&point["p"]);
        let stress = law.stress(h, p);
        close(1.0 + law.volume_change(h), number(&point["J"]));
        close(law.energy(h) - p * law.volume_change(h), number(&point["W"]));
        for (i, j, name) in [(0, 0, "P11"), (0, 1, "P12"), (1, 0, "P21"), (1, 1, "P22")] {
            close(stress[i][j], number(&point[name]));
        }
        close(law.stress_33(h, p), number(&point["P33"]));
    }
}

#[test]
fn incompressible_uniaxial_stretch() {
    let table = reference("s7_mooney_rivlin_point.json");
    let law = law(&table);
    for (stretch, expected) in table["incompressible_uniaxial_P11"].as_object().unwrap() {
        let l: f64 = stretch.parse().unwrap();
        let h = [[l - 1.0, 0.0], [0.0, 1.0 / l - 1.0]];
        // This pressure makes the lateral faces stress-free: P22 − p cof F_22 = 0.
        let p = law.stress(h, 0.0)[1][1] / l;
        close(law.stress(h, p)[0][0], number(expected));
    }
}

#[test]
fn simple_shear_stress_does_not_depend_on_the_pressure() {
    let law = law(&reference("s7_mooney_rivlin_point.json"));
    for p in [0.0, 1e3, -7e4] {
        // The error is the rounding of p.
        let error = law.stress([[0.0, 0.3], [0.0, 0.0]], p)[0][1] - 2.0 * 10_200.0 * 0.3;
        assert!(error.abs() < ROUNDING);
    }
}

/// A patch of irregular triangles is stretched uniaxially with free lateral faces. The exact solution is affine,
/// so it does not depend on the mesh.
#[test]
fn patch_test_of_uniaxial_stretch() {
    use myovib_fem::{DofMap, Mesh, Solid, Space};
    use std::sync::Arc;

    let table = reference("s7_mooney_rivlin_point.json");
    let case = &table["uniaxial_kappa_1e5"][0];
    let (stretch, lateral) = (number(&case["l"]), number(&case["lateral"]));
    // Interior vertices are moved at random, and the boundary of the unit square is kept.
    let regular = generate::rectangle([0.0; 2], [1.0; 2], [4, 4]).unwrap();
    let inside = |x: f64| x > 0.0 && x < 1.0;
    let points = regular
        .points()
        .iter()
        .zip(crate::common::random(25, 0.05, 9).iter().zip(crate::common::random(25, 0.05, 10)))
        .map(|(&[x, y], (dx, dy))| if inside(x) && inside(y) { [x + dx, y + dy] } else { [x, y] })
        .collect();
    let mesh =
        Mesh::new(points, regular.connectivity::<3>().to_vec(), regular.groups().clone()).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let side = |name: &str, component: usize| {
        space.nodes_of(name).unwrap().into_iter().map(move |node| (node, component))
    };
    let fixed: Vec<_> = side("left", 0).chain(side("right", 0)).chain(side("bottom", 1)).collect();
    let dofs = DofMap::new(&space, &fixed).unwrap();
    let solid = Solid::uniform(space.clone(), dofs, law(&table), 1.0).unwrap();
    let mut start =
        Equilibrium { u: vec![0.0; space.n_components()], p: vec![0.0; space.n_pressures()] };
    for (node, point) in space.node_points::<2>().iter().enumerate() {
        start.u[2 * node] = (stretch - 1.0) * point[0];
    }
    let load = vec![0.0; start.u.len()];
    let state = equilibrium(&solid, &load, 1e-5, false, start);
    for (node, point) in space.node_points::<2>().iter().enumerate() {
        // The last Newton step is below 1e-9 of the displacement, and the convergence is quadratic.
        assert!((state.u[2 * node] - (stretch - 1.0) * point[0]).abs() < 1e-12);
        assert!((state.u[2 * node + 1] - (lateral - 1.0) * point[1]).abs() < 1e-12);
    }
    let pressure = number(&case["p"]);
    assert!(state.p.iter().all(|p| (p / pressure - 1.0).abs() < 1e-10));
    let fields = myovib_fem::Fields::new(&state.u, myovib_fem::Pressure::Nodal(&state.p));
    let at = space.locate([0.3, 0.6]).unwrap();
    let point = solid.state_at(&fields, &at);
    assert!((point.jacobian / number(&case["J"]) - 1.0).abs() < 1e-11);
    assert!((point.piola[0][0] / number(&case["P11"]) - 1.0).abs() < 1e-10);
    assert!((point.cauchy[2][2] * point.jacobian / number(&case["P33"]) - 1.0).abs() < 1e-10);
    // The lateral faces are free and the shear is zero, so the von Mises stress follows from the two remaining
    // stresses.
    let (s1, s3) = (point.cauchy[0][0], point.cauchy[2][2]);
    let mises = (s1 * s1 - s1 * s3 + s3 * s3).sqrt();
    assert!((point.von_mises() / mises - 1.0).abs() < 1e-9);
}

#[test]
fn extreme_volume_ratios_are_located() {
    let mesh = generate::rectangle([0.0; 2], [1.0, 1.0], [4, 3]).unwrap();
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let solid = clamped(Space::taylor_hood(&mesh), "left", law);
    let space = solid.space();
    // The displacement u = (-0.4 x², 0) has J = 1 - 0.8 x. The minimum is at the rightmost quadrature point, and
    // the maximum is at the leftmost.
    let points = space.node_points().iter();
    let u: Vec<f64> = points.flat_map(|[x, _]| [-0.4 * x * x, 0.0]).collect();
    let ratios = solid.volume_ratios(&u);
    let at = ratios.at;
    let corners = mesh.corners::<2, 3>(at.element);
    let x: f64 = (0..3).map(|i| at.barycentric[i] * corners[i][0]).sum();
    let rule = solid.rule().points(space.mesh().shape());
    // The cells are 1/4 wide, and the lower triangles have two corners on the right.
    let least = rule.iter().flat_map(|q| q.barycentric.to_vec()).fold(1.0, f64::min);
    close(x, 1.0 - 0.25 * least);
    close(ratios.smallest, 1.0 - 0.8 * x);
    close(ratios.largest, 1.0 - 0.8 * 0.25 * least);
}

/// J = 1 - 1.004 x is positive at all quadrature points and negative at the vertices on the right.
#[test]
fn inverted_vertices_outside_quadrature_points_are_found() {
    let mesh = generate::rectangle([0.0; 2], [1.0, 1.0], [4, 3]).unwrap();
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let solid = clamped(Space::taylor_hood(&mesh), "left", law);
    let points = solid.space().node_points();
    let displaced = |factor: f64| -> Vec<f64> {
        let x = points.iter();
        x.flat_map(|[x, _]| [-factor * x * x, 0.0]).collect()
    };
    let u = displaced(0.502);
    assert!(solid.volume_ratios(&u).smallest > 0.0);
    let ratios = solid.vertex_volume_ratios(&u);
    let at = ratios.at;
    close(ratios.smallest, 1.0 - 1.004);
    close(ratios.largest, 1.0);
    let corners = mesh.corners::<2, 3>(at.element);
    let x: f64 = (0..3).map(|i| at.barycentric[i] * corners[i][0]).sum();
    close(x, 1.0);
    close(solid.vertex_volume_ratios(&displaced(0.4)).smallest, 1.0 - 0.8);
}

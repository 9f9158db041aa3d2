//! Tests of three-dimensional bodies: identities, follower pressures, and values from independent programs.

use std::sync::Arc;

use myovib_fem::material::three::{Axes, Tensor3};
use myovib_fem::quadrature::Rule;
use myovib_fem::solid::{Fields, Pressure, Solid, Vectors};
use myovib_fem::{DofMap, FollowerPressure, Mesh, Space, SurfaceOperator, generate, load};

use crate::common::{
    DENSITY, Equilibrium, MUSCLE_LAW, SMALL_LAW, clamped, dense, equilibrium, random,
};

pub(crate) const SIDES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

fn block(cells: [usize; 3]) -> Mesh {
    generate::block([0.0; 3], [2.0, 1.0, 0.5], cells).unwrap()
}

/// Returns the displacement map(x) − x as a function of x.
fn displacement(space: &Space, map: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    let moved = |&x: &[f64; 3]| {
        let y = map(x);
        [0, 1, 2].map(|i| y[i] - x[i])
    };
    space.node_points().iter().flat_map(moved).collect()
}

fn affine(f: Tensor3) -> impl Fn([f64; 3]) -> [f64; 3] {
    move |x| f.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

fn force_and_volume_residual(solid: &Solid, u: &[f64], p: &[f64]) -> [Vec<f64>; 2] {
    let [mut force, mut volume_residual] = [vec![0.0; u.len()], vec![0.0; p.len()]];
    let mut out = Vectors {
        force: Some(&mut force),
        volume_residual: Some(&mut volume_residual),
        ..Vectors::default()
    };
    let fields = Fields::new(u, Pressure::Nodal(p));
    solid.evaluate(&fields, &mut out).unwrap();
    [force, volume_residual]
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

#[test]
fn rigid_motions_have_no_force_and_volume_residual() {
    let solid = clamped(Space::taylor_hood(&block([3, 2, 1])), "left", MUSCLE_LAW);
    let p = vec![0.0; solid.space().n_pressures()];
    // Rotations about z and x.
    let ((s, c), (a, b)) = (0.7_f64.sin_cos(), 0.4_f64.sin_cos());
    let rotation = affine([[c, -s, 0.0], [b * s, b * c, -a], [a * s, a * c, b]]);
    let u = displacement(solid.space(), |x| {
        let y = rotation(x);
        [y[0] + 0.3, y[1] - 0.2, y[2] + 0.1]
    });
    let [force, volume_residual] = force_and_volume_residual(&solid, &u, &p);
    // The error is the rounding of u (1) divided by the element size (0.5), times the modulus (4e4 Pa) and the
    // face area.
    assert!(largest(&force) < 1e-10, "{:e}", largest(&force));
    assert!(largest(&volume_residual) < 1e-15, "{:e}", largest(&volume_residual));
    let [force, volume_residual] = force_and_volume_residual(&solid, &vec![0.0; u.len()], &p);
    assert_eq!((largest(&force), largest(&volume_residual)), (0.0, 0.0));
}

/// Patch test: an affine map has a constant stress, so forces at inner nodes cancel, and forces at the boundary
/// equal the traction of this stress.
#[test]
fn forces_of_affine_maps_equal_boundary_tractions() {
    let solid = clamped(Space::taylor_hood(&block([2, 2, 2])), "left", MUSCLE_LAW);
    let space = solid.space();
    let f = [[1.1, 0.2, -0.1], [0.05, 0.9, 0.15], [-0.12, 0.07, 1.05]];
    let u = displacement(space, affine(f));
    let p = vec![700.0; space.n_pressures()];
    let [force, _] = force_and_volume_residual(&solid, &u, &p);
    let h = [0, 1, 2].map(|i| [0, 1, 2].map(|j| f[i][j] - f64::from(i == j)));
    let stress = MUSCLE_LAW.stress3(h, 700.0, Axes::cartesian(0.0));
    let mut expected = vec![0.0; force.len()];
    for (number, side) in SIDES.into_iter().enumerate() {
        let outward = if number % 2 == 0 { -1.0 } else { 1.0 };
        let traction = stress.map(|row| outward * row[number / 2]);
        let load = load::traction(space, side, traction).unwrap();
        for (sum, load) in expected.iter_mut().zip(load) {
            *sum += load;
        }
    }
    // The error is the rounding of sums of a few hundred terms.
    let allowed = 1e-11 * largest(&expected);
    for (force, expected) in force.iter().zip(&expected) {
        assert!((force - expected).abs() < allowed);
    }
}

/// One layer of cells without transverse motion has the same energy as the plane body.
#[test]
fn layer_in_plane_strain_has_the_energy_of_the_2d_body() {
    let thickness = 0.3;
    let plane = generate::rectangle([0.0; 2], [2.0, 1.0], [3, 2]).unwrap();
    let plane = clamped(Space::equal_order(&plane), "left", MUSCLE_LAW);
    let mesh = generate::block([0.0; 3], [2.0, 1.0, thickness], [3, 2, 1]).unwrap();
    let sheet = clamped(Space::equal_order(&mesh), "left", MUSCLE_LAW);
    // With linear elements, the gradient in each tetrahedron equals the gradient in the triangle below it.
    let motion = |[x, y]: [f64; 2]| [0.05 * x * y + 0.1 * x, 0.04 * x * x - 0.06 * y];
    let plane_u: Vec<f64> = plane.space().node_points().iter().flat_map(|&x| motion(x)).collect();
    let extruded = |&[x, y, _]: &[f64; 3]| {
        let [u, v] = motion([x, y]);
        [u, v, 0.0]
    };
    let sheet_u: Vec<f64> = sheet.space().node_points().iter().flat_map(extruded).collect();
    let fields = |u| Fields::new(u, Pressure::Penalty { kappa: 1e5 });
    let energies = [
        plane.strain_energy(&fields(&plane_u)),
        sheet.strain_energy(&fields(&sheet_u)) / thickness,
    ];
    assert!((energies[1] / energies[0] - 1.0).abs() < 1e-13, "{energies:?}");
}

#[test]
fn refinement_preserves_volume_groups_and_fields() {
    let coarse = block([2, 1, 1]);
    let heights = coarse.points::<3>().iter().flat_map(|x| [x[2], x[0], 1.0]).collect();
    let field = myovib_fem::mesh::NodalField { components: 3, values: heights };
    let coarse = coarse.with_fields([("f".to_owned(), field)].into()).unwrap();
    let fine = coarse.refined().unwrap();
    assert_eq!(fine.n_elements(), 8 * coarse.n_elements());
    // The error is the rounding of a sum of 96 volumes with a total of 1.
    assert!((fine.measure() - coarse.measure()).abs() < 96.0 * f64::EPSILON);
    assert!(fine.notes().is_empty());
    for (vertex, x) in fine.points::<3>().iter().enumerate() {
        assert_eq!(fine.field("f").unwrap().at(vertex), [x[2], x[0], 1.0]);
    }
    let (coarse, fine) = (Space::taylor_hood(&coarse), Space::taylor_hood(&fine));
    for side in SIDES {
        let area = |space: &Space| -> f64 {
            space.quadrature(side).unwrap().iter().map(|(_, weight)| weight).sum()
        };
        assert!((area(&coarse) - area(&fine)).abs() < 1e-14, "{side}");
    }
}

#[test]
fn located_points_interpolate_quadratics_exactly() {
    let space = Space::taylor_hood(&block([2, 2, 1]));
    // A quadratic field is represented exactly.
    let f = |[x, y, z]: [f64; 3]| [x * x - y * z, y + x * z, z * z];
    let u: Vec<f64> = space.node_points().iter().flat_map(|&x| f(x)).collect();
    for point in [[0.3, 0.2, 0.1], [1.9, 0.95, 0.45], [1.0, 0.5, 0.25]] {
        let at = space.locate(point).expect("inside");
        let found: [f64; 3] = space.displacement_at(&u, &at);
        for (found, exact) in found.iter().zip(f(point)) {
            assert!((found - exact).abs() < 1e-14);
        }
    }
    assert!(space.locate([1.0, 0.5, 0.51]).is_none());
}

fn free_block() -> Solid {
    let space = Arc::new(Space::taylor_hood(&block([2, 1, 1])));
    let dofs = DofMap::new(&space, &[]).unwrap();
    Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY).unwrap()
}

pub(crate) fn follower(solid: &Solid, pressure: f64, u: &[f64], groups: &[&str]) -> Vec<f64> {
    let mut total = vec![0.0; u.len()];
    for group in groups {
        let operator = FollowerPressure::new(solid, group).unwrap();
        operator.add_force(pressure, u, &mut total);
    }
    total
}

#[test]
fn follower_pressure_on_a_closed_boundary_has_zero_resultant_and_moment() {
    let solid = free_block();
    let points = solid.space().node_points::<3>();
    let u = random(solid.space().n_components(), 0.05, 3);
    let force = follower(&solid, 7.0, &u, &SIDES);
    let (mut resultant, mut moment, mut size) = ([0.0; 3], [0.0; 3], 0.0);
    for (node, x) in points.iter().enumerate() {
        let f = [0, 1, 2].map(|i| force[3 * node + i]);
        let position = [0, 1, 2].map(|i| x[i] + u[3 * node + i]);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            resultant[i] += f[i];
            moment[i] += position[j] * f[k] - position[k] * f[j];
            size += f[i].abs();
        }
    }
    // There are two sides of at least 2 m² under 7 Pa.
    assert!(size > 14.0, "{size}");
    // The error is the rounding of a few hundred forces, which are at most 2 m from the origin.
    assert!(largest(&resultant) < 128.0 * f64::EPSILON * size, "{resultant:?}");
    assert!(largest(&moment) < 256.0 * f64::EPSILON * size, "{moment:?}");
}

#[test]
fn follower_pressure_under_an_affine_map_is_a_dead_traction() {
    let solid = free_block();
    let f = [[1.2, 0.3, 0.1], [-0.1, 0.9, 0.2], [0.05, -0.15, 1.1]];
    let u = displacement(solid.space(), affine(f));
    let h = [0, 1, 2].map(|i| [0, 1, 2].map(|j| f[i][j] - f64::from(i == j)));
    let cofactor = MUSCLE_LAW.volume_gradient3(h);
    for (number, side) in SIDES.into_iter().enumerate() {
        let outward = if number % 2 == 0 { -1.0 } else { 1.0 };
        let traction = cofactor.map(|row| -5.0 * outward * row[number / 2]);
        let expected = load::traction(solid.space(), side, traction).unwrap();
        for (found, expected) in follower(&solid, 5.0, &u, &[side]).iter().zip(&expected) {
            // The error is a dozen roundings of numbers of order 5.
            assert!((found - expected).abs() < 1e-13, "{side}: {found} {expected}");
        }
    }
}

#[test]
fn follower_stiffness_is_the_derivative_of_the_load() {
    let solid = free_block();
    let n = solid.dofs().n_full();
    let (u, d) = (random(n, 0.05, 5), random(n, 0.05, 6));
    let at = |s: f64| {
        let moved: Vec<f64> = u.iter().zip(&d).map(|(u, d)| u + s * d).collect();
        follower(&solid, 3.0, &moved, &SIDES)
    };
    let (plus, minus) = (at(1.0), at(-1.0));
    let mut values = vec![0.0; solid.displacement_pattern().nnz()];
    for group in SIDES {
        let operator = FollowerPressure::new(&solid, group).unwrap();
        operator.add_stiffness(3.0, &u, &mut values);
    }
    let matrix = dense(solid.displacement_pattern(), &values);
    for (row, (plus, minus)) in plus.iter().zip(&minus).enumerate() {
        let product: f64 = (0..n).map(|j| matrix[(row, j)] * d[j]).sum();
        // Central differences of a quadratic function are exact, so the error is the rounding of forces below 3.
        assert!((0.5 * (plus - minus) - product).abs() < 1e-13, "row {row}");
    }
}

/// Returns u_z and p at the origin of the spindle, which is in equilibrium under a dead traction.
fn spindle(rule: Rule, inv_kappa: f64) -> [f64; 2] {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/meshes/spindle_coarse.msh");
    let space = Arc::new(Space::taylor_hood(&Mesh::read_msh(path).unwrap()));
    assert_eq!((space.n_pressures(), space.n_elements()), (232, 617));
    assert_eq!(space.n_components() + space.n_pressures(), 4102);
    let dofs = DofMap::clamped(&space, &space.nodes_of("fixed").unwrap()).unwrap();
    assert_eq!(dofs.n_free() + space.n_pressures(), 3880);
    let load = load::traction(&space, "load", [0.0, 0.0, 100.0]).unwrap();
    let laws = vec![MUSCLE_LAW; space.n_elements()];
    let solid = Solid::with_rule(space.clone(), dofs, laws, DENSITY, rule).unwrap();
    let rest = Equilibrium { u: vec![0.0; load.len()], p: vec![0.0; space.n_pressures()] };
    let state = equilibrium(&solid, &load, inv_kappa, false, rest);
    let origin = space.locate([0.0; 3]).unwrap();
    let [_, _, u_z] = space.displacement_at(&state.u, &origin);
    [u_z, space.pressure_at(&state.p, &origin)]
}

/// The reference values are from scikit-fem and a second code with quadrature of degree 8. With degree 4, the
/// values differ by 4e-10 in u and 1e-8 in p.
#[test]
fn equilibrium_of_the_spindle_matches_other_programs() {
    let cases = [
        (1e-5, [1.494_787_223_758e-3, -13.396_633_622_04]),
        (0.0, [1.385_248_874_192e-3, -13.441_581_831_33]),
    ];
    for (inv_kappa, expected) in cases {
        let found = spindle(Rule::Degree4, inv_kappa);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 5e-8, "{found} {expected}");
        }
    }
    let [u, p] = spindle(Rule::Degree6, 0.0);
    let [(_, [exact_u, exact_p]), ..] = [cases[1]];
    assert!((u / exact_u - 1.0).abs() < 1e-11, "{u}");
    assert!((p / exact_p - 1.0).abs() < 1e-10, "{p}");
}

/// In two stacked materials, the pressure is constant in each material and has a jump at the interface.
#[test]
fn pressure_jumps_between_materials() {
    let mesh = generate::block([0.0; 3], [1.0; 3], [2, 2, 2]).unwrap();
    let above = |element: usize| {
        let corners = mesh.corners::<3, 4>(element);
        usize::from(corners.iter().map(|x| x[2]).sum::<f64>() > 2.0)
    };
    let regions: Vec<usize> = (0..mesh.n_elements()).map(above).collect();
    let space = Space::taylor_hood(&mesh).with_regions(&regions).unwrap();
    // There are three layers of nine vertices, and the middle layer has two pressures per vertex.
    assert_eq!((space.n_pressures(), mesh.n_points()), (36, 27));
    let space = Arc::new(space);
    // The body is confined by plates in x and y and stretched in z, which results in uniaxial strain in both
    // materials.
    let mut fixed = Vec::new();
    for (number, side) in SIDES.into_iter().enumerate() {
        let nodes = space.nodes_of(side).unwrap();
        fixed.extend(nodes.into_iter().map(|node| (node, number / 2)));
    }
    let dofs = DofMap::new(&space, &fixed).unwrap();
    let (soft, stiff) = (SMALL_LAW, SMALL_LAW.scaled(3.0));
    let laws = regions.iter().map(|&region| [soft, stiff][region]).collect();
    let solid = Solid::new(space.clone(), dofs, laws, DENSITY).unwrap();
    let kappa = 1e5;
    let start = Equilibrium {
        u: displacement(&space, |[x, y, z]| [x, y, 1.001 * z]),
        p: vec![0.0; space.n_pressures()],
    };
    let load = vec![0.0; start.u.len()];
    let state = equilibrium(&solid, &load, 1.0 / kappa, false, start);
    // Both materials have the stress κ e + 4/3 ζ e, where e1 + e2 = 0.002 for layers with a height of one half.
    let moduli = [2.04e4, 3.0 * 2.04e4].map(|zeta| kappa + 4.0 / 3.0 * zeta);
    let stress = 0.002 / (1.0 / moduli[0] + 1.0 / moduli[1]);
    for (element, &region) in regions.iter().enumerate() {
        for &pressure in space.element_pressures(element) {
            let expected = -kappa * stress / moduli[region];
            assert!((state.p[pressure] / expected - 1.0).abs() < 1e-10);
        }
    }
}

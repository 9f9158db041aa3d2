//! Curved bodies with exact solutions in 2D and 3D: sectors of rings and shells under internal
//! pressure.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::{DofMap, Law, Mesh, Solid, Space, generate};

use crate::common::{DENSITY, Equilibrium, SMALL_LAW, assert_orders, equilibrium};
use crate::convergence_in_space::errors_at_points;
use crate::spatial::{SIDES, follower};

fn length<const D: usize>(x: [f64; D]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns a sector of the ring 1 < r < 2 between two lines through the center.
fn ring(n: usize) -> Mesh {
    let square = generate::rectangle([0.0; 2], [1.0; 2], [n; 2]).unwrap();
    let map = |&[s, a]: &[f64; 2]| [1.0, a].map(|x| (1.0 + s) * x / length([1.0, a]));
    let points: Vec<[f64; 2]> = square.points::<2>().iter().map(map).collect();
    let triangles = square.connectivity::<3>().to_vec();
    Mesh::new(points, triangles, square.groups().clone()).unwrap()
}

/// Returns a sector of the shell 1 < r < 2 between four planes through the center.
fn shell(n: usize) -> Mesh {
    let map = |[s, a, b]: [f64; 3]| [1.0, a, b].map(|x| (1.0 + s) * x / length([1.0, a, b]));
    generate::spatial([n; 3], map).unwrap()
}

/// Returns the mesh in which each edge between vertices of equal radius is curved around the center.
fn curved<const D: usize>(mesh: Mesh) -> Mesh {
    let points = mesh.points::<D>();
    let mut midpoints = BTreeMap::new();
    for element in mesh.elements() {
        for (i, &a) in element.iter().enumerate() {
            for &b in &element[i + 1..] {
                let [r, other] = [a, b].map(|k| length(points[k]));
                if (r - other).abs() < 1e-12 {
                    let sum: [f64; D] = std::array::from_fn(|m| points[a][m] + points[b][m]);
                    midpoints.insert([a, b], sum.map(|x| r * x / length(sum)));
                }
            }
        }
    }
    mesh.with_midside_nodes(midpoints).unwrap()
}

/// Returns the errors for the incompressible body under internal pressure with small strains, in plane strain in
/// 2D. The equilibrium solution is u = A x/r^D. The radial stress σ_rr = −p − 2 (D − 1) ζ A/r^D with constant p is
/// −P inside and 0 outside. The sides through the center have exact displacements.
fn inflated<const D: usize>(mesh: &Mesh, through_the_center: &[&str]) -> [f64; 3] {
    const A: f64 = 0.01;
    let Law::SmallStrain { shear_modulus } = SMALL_LAW else {
        unreachable!("SMALL_LAW is a small-strain law")
    };
    let (power, dimension) = (D as i32, D as f64);
    let radial = |r: f64| -2.0 * (dimension - 1.0) * shear_modulus * A / r.powi(power);
    let p = radial(2.0);
    let inside = p - radial(1.0);
    let u = |x: [f64; D]| x.map(|x_i| A * x_i / length(x).powi(power));
    let gradient = |x: [f64; D]| {
        let r = length(x);
        let entry = |i: usize, j: usize| {
            f64::from(i == j) / r.powi(power) - dimension * x[i] * x[j] / r.powi(power + 2)
        };
        std::array::from_fn(|i| std::array::from_fn(|j| A * entry(i, j)))
    };
    let space = Arc::new(Space::taylor_hood(mesh));
    let fixed: Vec<usize> =
        through_the_center.iter().flat_map(|side| space.nodes_of(side).unwrap()).collect();
    let dofs = DofMap::clamped(&space, &fixed).unwrap();
    let solid = Solid::uniform(space.clone(), dofs, SMALL_LAW, DENSITY).unwrap();
    let load = follower(&solid, inside, &vec![0.0; space.n_components()], &["left"]);
    let start = Equilibrium {
        u: space.node_points().iter().flat_map(|&x| u(x)).collect(),
        p: vec![0.0; space.n_pressures()],
    };
    let state = equilibrium(&solid, &load, 0.0, false, start);
    errors_at_points(&solid, &state, |x| (u(x), gradient(x), p))
}

/// Curved elements have the expected orders. Straight elements do not, because the difference between the meshed
/// body and the exact body is proportional to the square of the element size.
fn assert_only_curved_elements_have_full_order(curved: [[f64; 3]; 2], straight: [[f64; 3]; 2]) {
    assert_orders(&curved);
    let order = (straight[0][0] / straight[1][0]).log2();
    assert!(order < 2.5, "{straight:?}");
    assert!(straight[1][0] > 3.0 * curved[1][0], "{straight:?} {curved:?}");
}

#[test]
fn ring_needs_curved_elements_for_full_order() {
    let errors = |mesh: Mesh| inflated::<2>(&mesh, &["bottom", "top"]);
    assert_only_curved_elements_have_full_order(
        [4, 8].map(|n| errors(curved::<2>(ring(n)))),
        [4, 8].map(|n| errors(ring(n))),
    );
}

#[test]
fn shell_needs_curved_elements_for_full_order() {
    let errors = |mesh: Mesh| inflated::<3>(&mesh, &SIDES[2..]);
    assert_only_curved_elements_have_full_order(
        [2, 4].map(|n| errors(curved::<3>(shell(n)))),
        [2, 4].map(|n| errors(shell(n))),
    );
}

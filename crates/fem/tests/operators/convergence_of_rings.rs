//! A plane body with curved edges and an exact solution: a piece of a ring under a pressure inside.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::{DofMap, Law, Mesh, Solid, Space, generate};

use crate::common::{DENSITY, Equilibrium, SMALL_LAW, equilibrium};
use crate::convergence_in_space::{assert_only_curved_elements_converge, errors_at_points};
use crate::spatial::follower;

/// A piece of the ring 1 < r < 2 between two lines through the centre, each edge on a circle around
/// it curved if `curved`.
fn ring(n: usize, curved: bool) -> Mesh {
    let square = generate::rectangle([0.0; 2], [1.0; 2], [n; 2]).unwrap();
    let place = |&[s, a]: &[f64; 2]| [1.0, a].map(|x| (1.0 + s) * x / length([1.0, a]));
    let points: Vec<[f64; 2]> = square.points::<2>().iter().map(place).collect();
    let triangles = square.connectivity::<3>().to_vec();
    let mut midpoints = BTreeMap::new();
    if curved {
        for [a, b, c] in &triangles {
            for edge in [[*a, *b], [*b, *c], [*c, *a]] {
                let [p, q] = edge.map(|vertex| points[vertex]);
                if (length(p) - length(q)).abs() < 1e-12 {
                    let sum = [p[0] + q[0], p[1] + q[1]];
                    midpoints.insert(edge, sum.map(|x| length(p) * x / length(sum)));
                }
            }
        }
    }
    let mesh = Mesh::new(points, triangles, square.groups().clone()).unwrap();
    mesh.bent(midpoints).unwrap()
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// The incompressible ring in plane strain, with small strains: u = A x/r² from equilibrium, as
/// σ_rr = −p − 2 ζ A/r² with a constant p is −P inside and 0 outside. The lines are held where this
/// puts them.
fn inflated(mesh: &Mesh) -> [f64; 3] {
    const A: f64 = 0.01;
    let Law::SmallStrain { shear_modulus } = SMALL_LAW else {
        unreachable!("the law of small strains")
    };
    let (p, inside) = (-0.5 * shear_modulus * A, 1.5 * shear_modulus * A);
    let u = |x: [f64; 2]| x.map(|x_i| A * x_i / length(x).powi(2));
    let gradient = |x: [f64; 2]| {
        let r = length(x);
        [0, 1].map(|i| {
            [0, 1].map(|j| A * (f64::from(i == j) / r.powi(2) - 2.0 * x[i] * x[j] / r.powi(4)))
        })
    };
    let space = Arc::new(Space::taylor_hood(mesh));
    let lines = ["bottom", "top"];
    let held: Vec<usize> = lines
        .iter()
        .flat_map(|side| space.nodes_of(side).unwrap())
        .collect();
    let dofs = DofMap::clamped(&space, &held).unwrap();
    let solid = Solid::uniform(space.clone(), dofs, SMALL_LAW, DENSITY).unwrap();
    let load = follower(&solid, inside, &vec![0.0; space.n_components()], &["left"]);
    let start = Equilibrium {
        u: space.node_points().iter().flat_map(|&x| u(x)).collect(),
        p: vec![0.0; space.n_pressures()],
    };
    let state = equilibrium(&solid, &load, 0.0, false, start);
    errors_at_points(&solid, &state, |x| (u(x), gradient(x), p))
}

#[test]
fn a_ring_converges_with_the_orders_of_the_elements_only_if_they_are_curved() {
    let of = |curved| [4, 8].map(|n| inflated(&ring(n, curved)));
    assert_only_curved_elements_converge(of(true), of(false));
}

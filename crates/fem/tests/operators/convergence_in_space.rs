//! Bodies in space with exact solutions: orders of convergence, on curved bodies too.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::material::Law;
use myovib_fem::material::three::{Axes, Tensor3};
use myovib_fem::solid::Solid;
use myovib_fem::{DofMap, Located, Mesh, Space, generate, load};

use crate::common::{DENSITY, Equilibrium, MUSCLE_LAW, SMALL_LAW, assert_orders, equilibrium};
use crate::spatial::{SIDES, follower};

/// A block sheared along x by γ(y, z): det F = 1 everywhere.
struct Sheared;

impl Sheared {
    fn u([_, y, z]: [f64; 3]) -> [f64; 3] {
        [0.2 * (1.5 * y).sin() * (1.2 * z).cos(), 0.0, 0.0]
    }

    fn gradient([_, y, z]: [f64; 3]) -> Tensor3 {
        let (a, b) = (1.5 * y, 1.2 * z);
        [
            [0.0, 0.3 * a.cos() * b.cos(), -0.24 * a.sin() * b.sin()],
            [0.0; 3],
            [0.0; 3],
        ]
    }

    fn p([x, y, z]: [f64; 3]) -> f64 {
        4e3 * (x * x * y - 0.3 * z)
    }

    fn stress(x: [f64; 3]) -> Tensor3 {
        MUSCLE_LAW.stress3(Self::gradient(x), Self::p(x), Axes::cartesian(0.0))
    }

    /// −div P, by differences of sixth order: their error is 1e-9 of the force.
    fn load(x: [f64; 3]) -> [f64; 3] {
        const H: f64 = 0.01;
        let along = |j: usize, s: f64| {
            let mut at = x;
            at[j] += s * H;
            Self::stress(at)
        };
        let mut force = [0.0; 3];
        for j in 0..3 {
            for (s, weight) in [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)] {
                let (plus, minus) = (along(j, s), along(j, -s));
                for i in 0..3 {
                    force[i] -= weight * (plus[i][j] - minus[i][j]) / (60.0 * H);
                }
            }
        }
        force
    }
}

/// Errors in L2 of u, H1 seminorm of u, L2 of p against a solution, by the rule of degree 6.
pub(crate) fn errors_at_points<const D: usize>(
    solid: &Solid,
    state: &Equilibrium,
    exact: impl Fn([f64; D]) -> ([f64; D], [[f64; D]; D], f64),
) -> [f64; 3] {
    let space = solid.space();
    let mut squares = [0.0; 3];
    let all: Vec<(Located, f64)> = space.quadrature("body").unwrap();
    for (at, weight) in all {
        let (u, gradient, p) = exact(space.place(&at));
        let found: [f64; D] = space.displacement_at(&state.u, &at);
        let h: [[f64; D]; D] = solid.gradient_at(&state.u, &at);
        for i in 0..D {
            squares[0] += weight * (found[i] - u[i]).powi(2);
            for j in 0..D {
                squares[1] += weight * (h[i][j] - gradient[i][j]).powi(2);
            }
        }
        squares[2] += weight * (space.pressure_at(&state.p, &at) - p).powi(2);
    }
    squares.map(f64::sqrt)
}

/// The incompressible block held on its whole boundary where the exact solution puts it.
fn sheared(mesh: &Mesh) -> [f64; 3] {
    let space = Arc::new(Space::taylor_hood(mesh));
    let held: Vec<usize> = SIDES
        .iter()
        .flat_map(|s| space.nodes_of(s).unwrap())
        .collect();
    let dofs = DofMap::clamped(&space, &held).unwrap();
    let solid = Solid::uniform(space.clone(), dofs, MUSCLE_LAW, 1.0).unwrap();
    let load = load::body_force(&space, Sheared::load);
    let start = Equilibrium {
        u: space
            .node_points()
            .iter()
            .flat_map(|&x| Sheared::u(x))
            .collect(),
        p: vec![0.0; space.n_pressures()],
    };
    let mut state = equilibrium(&solid, &load, 0.0, true, start);
    // The pressure is determined up to a constant.
    let body = space.quadrature("body").unwrap();
    let apart = |(at, weight): &(Located, f64)| {
        weight * (Sheared::p(space.place(at)) - space.pressure_at(&state.p, at))
    };
    let shift = body.iter().map(apart).sum::<f64>() / space.measure();
    state.p.iter_mut().for_each(|p| *p += shift);
    errors_at_points(&solid, &state, |x| {
        (Sheared::u(x), Sheared::gradient(x), Sheared::p(x))
    })
}

#[test]
fn a_sheared_block_converges_with_the_orders_of_the_elements() {
    let of = |n: usize| sheared(&generate::block([0.0; 3], [1.0; 3], [n; 3]).unwrap());
    assert_orders(&[of(2), of(4)]);
}

/// A piece of the shell 1 < r < 2 between four planes through the centre, each edge on a sphere
/// around it curved if `curved`.
fn shell(n: usize, curved: bool) -> Mesh {
    let mesh = generate::spatial([n; 3], |[s, a, b]| {
        let size = (1.0 + a * a + b * b).sqrt();
        [1.0, a, b].map(|x| (1.0 + s) * x / size)
    });
    let mesh = mesh.unwrap();
    let mut midpoints = BTreeMap::new();
    if curved {
        let points = mesh.points::<3>();
        for element in mesh.connectivity::<4>() {
            for (i, &a) in element.iter().enumerate() {
                for &b in &element[i + 1..] {
                    let [r, other] = [a, b].map(|k| length(points[k]));
                    if (r - other).abs() < 1e-12 {
                        let sum = [0, 1, 2].map(|m| points[a][m] + points[b][m]);
                        midpoints.insert([a, b], sum.map(|x| r * x / length(sum)));
                    }
                }
            }
        }
    }
    mesh.bent(midpoints).unwrap()
}

fn length(x: [f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The incompressible shell under a pressure inside, with small strains: u = A x/r³ from
/// equilibrium, as σ_rr = −p − 4 ζ A/r³ with a constant p is −P inside and 0 outside. The planes are
/// held where this puts them.
fn inflated(mesh: &Mesh) -> [f64; 3] {
    const A: f64 = 0.01;
    let Law::SmallStrain { shear_modulus } = SMALL_LAW else {
        unreachable!("the law of small strains")
    };
    let (p, inside) = (-0.5 * shear_modulus * A, 3.5 * shear_modulus * A);
    let u = |x: [f64; 3]| x.map(|x_i| A * x_i / length(x).powi(3));
    let gradient = |x: [f64; 3]| {
        let r = length(x);
        [0, 1, 2].map(|i| {
            [0, 1, 2].map(|j| A * (f64::from(i == j) / r.powi(3) - 3.0 * x[i] * x[j] / r.powi(5)))
        })
    };
    let space = Arc::new(Space::taylor_hood(mesh));
    let planes = &SIDES[2..];
    let held: Vec<usize> = planes
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

/// Elements as curved as the body have their orders; straight ones lose them, as they fill another
/// body, which is nearer by no more than the square of their size.
#[test]
fn a_curved_shell_converges_with_the_orders_of_the_elements_only_if_they_are_curved() {
    let of = |curved| [2, 4].map(|n| inflated(&shell(n, curved)));
    assert_only_curved_elements_converge(of(true), of(false));
}

pub(crate) fn assert_only_curved_elements_converge(curved: [[f64; 3]; 2], straight: [[f64; 3]; 2]) {
    assert_orders(&curved);
    let lost = (straight[0][0] / straight[1][0]).log2();
    assert!(lost < 2.5, "{straight:?}");
    assert!(
        straight[1][0] > 3.0 * curved[1][0],
        "{straight:?} {curved:?}"
    );
}

//! A body in space with an exact solution: orders of convergence.

use std::sync::Arc;

use myovib_fem::material::three::{Axes, Tensor3};
use myovib_fem::solid::Solid;
use myovib_fem::{DofMap, ElementPoint, Mesh, Space, generate, load};

use crate::common::{Equilibrium, MUSCLE_LAW, assert_orders, equilibrium};
use crate::spatial::SIDES;

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
    let all: Vec<(ElementPoint, f64)> = space.quadrature("body").unwrap();
    for (at, weight) in all {
        let (u, gradient, p) = exact(space.position(&at));
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
    let apart = |(at, weight): &(ElementPoint, f64)| {
        weight * (Sheared::p(space.position(at)) - space.pressure_at(&state.p, at))
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

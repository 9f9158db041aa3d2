//! Convergence orders of a three-dimensional body with an exact solution.

use std::sync::Arc;

use myovib_fem::material::three::{Axes, Tensor3};
use myovib_fem::solid::Solid;
use myovib_fem::{DofMap, ElementPoint, Mesh, Space, generate, load};

use crate::common::{Equilibrium, MUSCLE_LAW, assert_orders, equilibrium};
use crate::spatial::SIDES;

/// Block sheared along x by γ(y, z), so that det F = 1 everywhere.
struct Sheared;

impl Sheared {
    fn u([_, y, z]: [f64; 3]) -> [f64; 3] {
        [0.2 * (1.5 * y).sin() * (1.2 * z).cos(), 0.0, 0.0]
    }

    fn gradient([_, y, z]: [f64; 3]) -> Tensor3 {
        let (a, b) = (1.5 * y, 1.2 * z);
        [[0.0, 0.3 * a.cos() * b.cos(), -0.24 * a.sin() * b.sin()], [0.0; 3], [0.0; 3]]
    }

    fn p([x, y, z]: [f64; 3]) -> f64 {
        4e3 * (x * x * y - 0.3 * z)
    }

    fn stress(x: [f64; 3]) -> Tensor3 {
        MUSCLE_LAW.stress3(Self::gradient(x), Self::p(x), Axes::cartesian(0.0))
    }

    /// Returns −div P, computed by sixth-order differences with an error of 1e-9 relative to the force.
    fn load(x: [f64; 3]) -> [f64; 3] {
        const H: f64 = 0.01;
        let stress_at = |j: usize, s: f64| {
            let mut at = x;
            at[j] += s * H;
            Self::stress(at)
        };
        let mut force = [0.0; 3];
        for j in 0..3 {
            for (s, weight) in [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)] {
                let (plus, minus) = (stress_at(j, s), stress_at(j, -s));
                for i in 0..3 {
                    force[i] -= weight * (plus[i][j] - minus[i][j]) / (60.0 * H);
                }
            }
        }
        force
    }
}

/// Returns the errors of u in the L2 norm, of u in the H1 seminorm, and of p in the L2 norm, integrated by the
/// rule of degree 6.
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

/// Returns the errors for the incompressible block with exact displacements on the whole boundary.
fn sheared(mesh: &Mesh) -> [f64; 3] {
    let space = Arc::new(Space::taylor_hood(mesh));
    let fixed: Vec<usize> = SIDES.iter().flat_map(|s| space.nodes_of(s).unwrap()).collect();
    let dofs = DofMap::clamped(&space, &fixed).unwrap();
    let solid = Solid::uniform(space.clone(), dofs, MUSCLE_LAW, 1.0).unwrap();
    let load = load::element_body_force(&space, |_, x| Sheared::load(x));
    let start = Equilibrium {
        u: space.node_points().iter().flat_map(|&x| Sheared::u(x)).collect(),
        p: vec![0.0; space.n_pressures()],
    };
    let mut state = equilibrium(&solid, &load, 0.0, true, start);
    // The pressure is determined up to a constant.
    let body = space.quadrature("body").unwrap();
    let difference = |(at, weight): &(ElementPoint, f64)| {
        weight * (Sheared::p(space.position(at)) - space.pressure_at(&state.p, at))
    };
    let shift = body.iter().map(difference).sum::<f64>() / space.measure();
    state.p.iter_mut().for_each(|p| *p += shift);
    errors_at_points(&solid, &state, |x| (Sheared::u(x), Sheared::gradient(x), Sheared::p(x)))
}

#[test]
fn sheared_block_converges_with_the_expected_orders() {
    let errors = |n: usize| sheared(&generate::block([0.0; 3], [1.0; 3], [n; 3]).unwrap());
    assert_orders(&[errors(2), errors(4)]);
}

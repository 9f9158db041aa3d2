//! Static response of the muscle to a constant traction, compared with an independent program.

use crate::common::{Equilibrium, MUSCLE_LAW, clamped, equilibrium, muscle_mesh};
use myovib_fem::{Space, load};

/// Returns u_y and p at the origin for the traction τ = (0, 100) on `load`.
fn response(inv_kappa: f64) -> (f64, f64) {
    let space = Space::taylor_hood(&muscle_mesh());
    let load = load::traction(&space, "load", [0.0, 100.0]).unwrap();
    let rest = Equilibrium { u: vec![0.0; load.len()], p: vec![0.0; space.n_pressures()] };
    let solid = clamped(space, "fixed", MUSCLE_LAW);
    let state = equilibrium(&solid, &load, inv_kappa, false, rest);
    let origin = solid.space().locate([0.0, 0.0]).unwrap();
    (
        solid.space().displacement_at::<2>(&state.u, &origin)[1],
        solid.space().pressure_at(&state.p, &origin),
    )
}

/// Asserts agreement with a value from an independent program, to the five digits of this value.
fn agrees(found: f64, stated: f64) {
    assert!((found / stated - 1.0).abs() < 5e-5, "{found} {stated}");
}

#[test]
fn muscle_mesh_has_the_published_number_of_unknowns() {
    let mesh = muscle_mesh();
    let space = Space::taylor_hood(&mesh);
    assert_eq!((mesh.n_points(), mesh.n_elements()), (185, 311));
    assert_eq!(space.n_nodes(), 680);
    assert_eq!(space.n_components() + space.n_pressures(), 1545);
    assert_eq!(space.nodes_of("fixed").unwrap().len(), 14);
}

#[test]
fn static_response_compressible() {
    let (u, p) = response(1e-5);
    agrees(u, 6.5395e-4);
    agrees(p, -19.769);
}

#[test]
fn static_response_incompressible() {
    let (u, p) = response(0.0);
    agrees(u, 5.7108e-4);
    agrees(p, -22.170);
}

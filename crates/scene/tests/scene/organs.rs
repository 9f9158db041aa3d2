//! Bodies in the shape of organs, meshed by Gmsh, nearly incompressible and incompressible.

use std::path::{Path, PathBuf};

use myovib_model::check::Size;
use myovib_scene::Scene;

use crate::contact::{last, tables_in};

/// Returns the mean displacement and pressure of the free boundary of a body under its weight, with a pressure around it.
fn equilibrium(name: &str, bulk_modulus: &str, outer_pressure: f64) -> [f64; 4] {
    let text = format!(
        "{}[[body_force]]\nx = 4.0\ny = 2.0\nz = -3.0\n\
         [[pressure]]\ngroup = \"free\"\nvalue = {outer_pressure}\n\
         [[probe]]\nname = \"free\"\ntype = \"average\"\ngroup = \"free\"\n",
        organ(name, bulk_modulus)
    );
    let [table] = tables_in(&text, &folder(), ["free"]);
    ["u_x", "u_y", "u_z", "p"].map(|column| last(&table, column))
}

/// Returns the scene of an organ on its supports.
fn organ(name: &str, bulk_modulus: &str) -> String {
    format!(
        "analysis = \"static\"\n[mesh]\ntype = \"file\"\npath = \"{name}.msh\"\n[solid]\n\
         bulk_modulus = {bulk_modulus}\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 5e3\n\
         [[fixed]]\ngroup = \"held\"\n"
    )
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/organs")
}

/// Checks that nearly incompressible bodies deflect like incompressible ones, except for a fraction of about the ratio of the
/// moduli, 5e-3; the test allows twice that. A pressure around an incompressible body adds to its own pressure and does not
/// deform it, up to ten times the last relative increment of Newton's method, 1e-9.
#[test]
fn organs_deflect_alike_with_large_and_infinite_bulk_modulus() {
    const OUTER: f64 = 150.0;
    for name in ["artery", "eye", "limb", "liver", "tongue", "ventricle"] {
        let nearly = equilibrium(name, "1e6", 0.0);
        let fully = equilibrium(name, "inf", 0.0);
        let inside = equilibrium(name, "inf", OUTER);
        let size = fully[..3].iter().map(|u| u * u).sum::<f64>().sqrt();
        assert!(size > 0.0);
        for i in 0..3 {
            let difference = (nearly[i] - fully[i]).abs();
            assert!(difference < 1e-2 * size, "{name}, u_{i}: {difference:e} of {size:e}");
            let change = (inside[i] - fully[i]).abs();
            assert!(change < 1e-8 * size, "{name}, u_{i}: {change:e} of {size:e}");
        }
        let change = inside[3] - fully[3] - OUTER;
        assert!(change.abs() < 1e-8 * OUTER, "{name}: {change:e}");
    }
}

/// Regression: the mass was computed with straight edges and was 3 % too small.
#[test]
fn a_body_with_curved_elements_has_the_mass_of_its_volume() {
    let scene = Scene::build("scene.toml", &organ("ventricle", "inf"), &[], &folder()).unwrap();
    let size = Size::of(&scene.body.unwrap().muscle);
    // The tolerance covers the rounding of sums over about 500 elements.
    assert!((size.mass / (1e3 * size.volume) - 1.0).abs() < 500.0 * f64::EPSILON, "{size:?}");
}

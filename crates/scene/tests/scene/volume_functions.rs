//! Energies of volume changes.

use std::path::Path;

use myovib_scene::Scene;

use crate::contact::{column, last, tables_in};

const BULK_MODULUS: f64 = 4e4;
const PRESSURE: f64 = 2e4;

/// Returns a cube on three planes of symmetry under a pressure on its other faces.
fn compressed(formulation: &str, energy: &str) -> String {
    let planes = [("left", "x"), ("front", "y"), ("bottom", "z")].map(|(group, axis)| {
        format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"{axis}\"]\n")
    });
    let faces = ["right", "back", "top"]
        .map(|group| format!("[[pressure]]\ngroup = \"{group}\"\nvalue = {PRESSURE}\n"));
    format!(
        "analysis = \"static\"\n[mesh]\ntype = \"box\"\nsize = [0.01, 0.01, 0.01]\ncells = [1, 1, 1]\n[solid]\n\
         bulk_modulus = {BULK_MODULUS}\nformulation = \"{formulation}\"\nvolumetric_energy = \"{energy}\"\n\
         [[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n{}{}\
         [[probe]]\nname = \"corner\"\ntype = \"point\"\nat = [0.01, 0.01, 0.01]\nquantities = [\"u\", \"p\"]\n",
        planes.concat(),
        faces.concat()
    )
}

/// Checks that, under a pressure P, the derivative of the volumetric energy with respect to J is −P.
#[test]
fn a_cube_under_pressure_has_the_volume_of_its_energy() {
    // The bisection solves −κ ln(J)/J = P.
    let (mut low, mut high) = (0.5_f64, 1.0_f64);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        match -BULK_MODULUS * middle.ln() / middle > PRESSURE {
            true => low = middle,
            false => high = middle,
        }
    }
    for (energy, exact) in [("quadratic", 1.0 - PRESSURE / BULK_MODULUS), ("logarithmic", low)] {
        for formulation in ["displacement", "position"] {
            let text = compressed(formulation, energy);
            let [corner] = tables_in(&text, Path::new(""), ["corner"]);
            let volume: f64 = ["u_x", "u_y", "u_z"]
                .map(|name| 1.0 + last(&corner, name) / 0.01)
                .into_iter()
                .product();
            let pressure = last(&corner, "p");
            // p is −κ g(J), and the pressure on the deformed faces its product with g'(J).
            let slope = if energy == "logarithmic" { 1.0 / exact } else { 1.0 };
            // The last Newton increments are below 1e-9, and the error is about their square, so only rounding errors
            // remain.
            for ratio in [volume / exact, slope * pressure / PRESSURE] {
                assert!((ratio - 1.0).abs() < 1e-12, "{energy} {formulation}: {ratio}");
            }
        }
    }
}

/// Checks that all formulations move a damped block alike, up to 100 times the tolerance of the integrator for each run and, without
/// pressures, the error of the mesh.
#[test]
fn all_formulations_have_the_logarithmic_energy() {
    const RTOL: f64 = 1e-6;
    let end = |formulation: &str, energy: &str| {
        let text = format!(
            "[time]\nend = 0.05\n[mesh]\ntype = \"rectangle\"\nwidth = 0.02\nheight = 0.01\ncells = [4, 2]\n[solid]\n\
             bulk_modulus = {BULK_MODULUS}\nrayleigh_stiffness = {}\nformulation = \"{formulation}\"\n\
             volumetric_energy = \"{energy}\"\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
             [[fixed]]\ngroup = \"bottom\"\n[[traction]]\ngroup = \"top\"\ny = {{ type = \"step\", value = -4e3, rise = 0.02 }}\n\
             [[probe]]\nname = \"corner\"\ntype = \"point\"\nat = [0.02, 0.01]\ninterval = 0.01\n[integrator]\nrtol = {RTOL:e}\n",
            if formulation.ends_with("rate") { 1e-3 } else { 0.0 }
        );
        let [corner] = tables_in(&text, Path::new(""), ["corner"]);
        column(&corner, "u_y")
    };
    let last = |formulation: &str, energy: &str| *end(formulation, energy).last().unwrap();
    for alike in [["position", "velocity"], ["rate", "implicit-rate"]] {
        let [a, b] = alike.map(|formulation| end(formulation, "logarithmic"));
        let largest = a.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 200.0 * RTOL * largest, "{alike:?}: {a:e} {b:e}");
        }
    }
    // The mesh is stiffer without pressures, but the result is nearer to the same energy than to the other.
    let [quadratic, logarithmic] =
        ["quadratic", "logarithmic"].map(|energy| last("position", energy));
    let plain = last("displacement", "logarithmic");
    assert!(
        (plain - logarithmic).abs() < (plain - quadratic).abs(),
        "{plain:e} {quadratic:e} {logarithmic:e}"
    );
}

/// Checks that a law with its own volumetric energy, small strains and incompressible bodies exclude the choice.
#[test]
fn bodies_without_a_volumetric_energy_reject_the_choice() {
    let text = compressed("position", "logarithmic");
    let law = "law = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4";
    for text in [
        text.replace("bulk_modulus = 40000", "bulk_modulus = inf"),
        text.replace(law, &law.replace("neo-hooke", "small-strain")),
    ] {
        let error = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap_err();
        let error = error.to_string();
        assert!(error.contains(" | volumetric_energy"), "{error}");
    }
}

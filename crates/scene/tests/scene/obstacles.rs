//! Obstacles that follow a force in time.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::sensitivity::{Unsupported, unsupported};

use crate::contact::{column, last, pressed, tables_in};

/// Relative tolerance of the integration.
const RTOL: f64 = 1e-6;
/// A force, N/m, that rises smoothly to its value.
const RAMP: &str = "{ type = \"step\", value = 40.0, rise = 0.2 }";

/// A viscoelastic block under the plate, compressible and without friction at its sides.
fn block(head: &str, contact: &str) -> String {
    let material =
        "shear_modulus = 1e4\nprony = [{ relative_modulus = 0.5, relaxation_time = 0.3 }]";
    pressed(head, contact).replace("inf", "2e4").replace("shear_modulus = 1e4", material)
        + &format!("[integrator]\nrtol = {RTOL:e}\n")
}

fn run(text: &str, probes: [&str; 2]) -> [Table; 2] {
    tables_in(text, Path::new(""), probes)
}

/// The block is homogeneous, so a plate with a force has the pressure of a traction, and its creep.
#[test]
fn a_block_creeps_under_a_plate_as_under_a_traction() {
    let head = "analysis = \"quasi-static\"\n[time]\nend = 1.0\n";
    let force = format!("force = {RAMP}\ndirection = [0.0, -1.0]\nstiffness = 1e8");
    let [plate, corner] = run(&block(head, &force), ["plate", "corner"]);
    let traction = block(head, "y = 1.0").replace(
        "[solid]",
        "[[traction]]\ngroup = \"top\"\n\
        y = { type = \"step\", value = -2000.0, rise = 0.2 }\n[solid]",
    );
    let [_, exact] = run(&traction, ["plate", "corner"]);
    let (found, exact) = (column(&corner, "u_y"), column(&exact, "u_y"));
    let deepest = -exact[exact.len() - 1];
    let at_rise = column(&corner, "t").iter().position(|t| *t >= 0.2).unwrap();
    // The block creeps after the force has risen.
    assert!(-exact[at_rise] < 0.9 * deepest);
    for (found, exact) in found.iter().zip(&exact) {
        // Each run has an error of about the tolerance.
        assert!((found - exact).abs() < 10.0 * RTOL * deepest, "{found} {exact}");
    }
    assert!((last(&plate, "F_y") + 40.0).abs() < 1e-9);
    let penetration = last(&plate, "penetration");
    let depth = last(&plate, "displacement");
    assert!((depth - penetration + found[found.len() - 1]).abs() < 1e-9);
}

/// A block under a ball with a force that rises slowly.
fn ball(head: &str, bulk_modulus: &str) -> String {
    let text = pressed(head, &format!("force = {RAMP}\ndirection = [0.0, -1.0]"));
    text.replace("inf", bulk_modulus).replace("cells = [6, 3]", "cells = [2, 1]").replace(
        "type = \"plane\"\npoint = [0.0, 0.01]\nnormal = [0.0, -2.0]",
        "type = \"sphere\"\ncenter = [0.0, 0.021]\nradius = 0.01",
    ) + "[[probe]]\nname = \"energy\"\ntype = \"energy\"\n"
}

/// The ball indents the block in a motion as deep as in an equilibrium, even with inertia: in all formulations, by both methods, and
/// with chains whose feedback is too weak to matter.
#[test]
fn slow_indentation_by_a_force_ends_in_its_equilibrium() {
    let depth = |bulk_modulus: &str, formulation: &str| {
        let text = ball("analysis = \"static\"\n[time]\nend = 1.0\n", bulk_modulus);
        let own = format!("[solid]\nformulation = \"{formulation}\"\n");
        let [exact] = tables_in(&text.replace("[solid]\n", &own), Path::new(""), ["plate"]);
        last(&exact, "displacement")
    };
    let slow = ball("analysis = \"quasi-static\"\n[time]\nend = 0.3\n", "2e4");
    let [plate, _] = run(&slow, ["plate", "energy"]);
    assert!((last(&plate, "displacement") / depth("2e4", "position") - 1.0).abs() < 1e-6);
    let rtol = 1e-4;
    let chain = "[[chain]]\nname = \"spindles\"\nat = [0.0, 0.0]\noscillators = 4\n[[feedback]]\nchain = \"spindles\"\nat_zero_coherence = 1.0000001\n";
    for (formulation, bulk_modulus, damping, method, rest) in [
        ("position", "2e4", "0.0", "radau9", ""),
        ("position", "2e4", "0.0", "bdf", ""),
        ("displacement", "2e4", "0.0", "radau9", ""),
        ("velocity", "inf", "0.0", "radau9", ""),
        ("implicit-rate", "inf", "1e-3", "radau9", ""),
        ("position", "2e4", "0.0", "radau9", chain),
    ] {
        let own = format!(
            "[solid]\nrayleigh_mass = 40.0\nrayleigh_stiffness = {damping}\nformulation = \"{formulation}\"\n"
        );
        let text = ball("[time]\nend = 0.8\n", bulk_modulus).replace("[solid]\n", &own)
            + &format!("[integrator]\nmethod = \"{method}\"\nrtol = {rtol:e}\n{rest}");
        let [plate, energy] = run(&text, ["plate", "energy"]);
        let exact = match formulation {
            "displacement" => depth(bulk_modulus, formulation),
            _ => depth(bulk_modulus, "position"),
        };
        let error = last(&plate, "displacement") / exact - 1.0;
        let work = last(&energy, "work");
        let imbalance = column(&energy, "imbalance");
        let imbalance = imbalance.iter().fold(0.0_f64, |most, own| most.max(own.abs()));
        // The damping exp(−20 t) of 0.6 s after the rise leaves at most this part of the vibration. The guide expects
        // errors of at least 10 tolerances of BDF.
        let vibration = (-20.0_f64 * 0.6).exp();
        assert!(error.abs() < rtol + vibration, "{formulation} {method}: {error:e}");
        assert!(
            work > 0.0 && imbalance < if method == "bdf" { 10.0 * rtol } else { rtol } * work,
            "{formulation} {method}: {imbalance:e} {work:e}"
        );
    }
}

/// A fit of the depth in time has no derivatives.
#[test]
fn sensitivities_of_motions_need_given_displacements() {
    let text =
        pressed("[time]\nend = 1.0\n", "force = 1.0\ndirection = [0.0, -1.0]\nstiffness = 1e8");
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let (feature, key) = unsupported(&scene).unwrap();
    assert_eq!((feature, &*key), (Unsupported::ObstacleForce, "contact[0].force"));
}

/// Friction needs the velocity of the obstacle, and a response its stiffness.
#[test]
fn invalid_forces_in_time_are_rejected() {
    let force = "force = 1.0\ndirection = [0.0, -1.0]";
    let pulling =
        "force = { type = \"sine\", amplitude = 1.0, frequency = 1.0 }\ndirection = [0.0, -1.0]";
    let jumping = "force = { type = \"step\", value = 1.0, rise = 0.0 }\ndirection = [0.0, -1.0]";
    let slip = format!("{force}\nfriction = 0.3\nslip_velocity = 1e-4");
    for (head, contact, line) in [
        ("[time]\nend = 1.0\n", &*slip, "friction = 0.3"),
        ("[time]\nend = 1.0\n", pulling, "force = { type = \"sine\""),
        ("[time]\nend = 1.0\n", jumping, "force = { type = \"step\""),
        ("analysis = \"modes\"\n", force, "force = 1.0"),
    ] {
        let text = pressed(head, contact);
        let error = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap_err();
        assert!(error.to_string().contains(&format!(" | {line}")), "{error}");
    }
}

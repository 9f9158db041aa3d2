//! Obstacles that follow a force in time, obstacles in wrong places, and invalid obstacles.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use myovib_model::ModelError;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::sensitivity::{Unsupported, unsupported};
use myovib_scene::{Error, Scene};

use crate::contact::{column, last, pressed, tables_in};
use crate::separate_chains::Interrupt;

/// Relative tolerance of the integration.
const RTOL: f64 = 1e-6;
/// A force, N/m, that rises smoothly to its value.
const RAMP: &str = "{ type = \"step\", value = 40.0, rise = 0.2 }";

/// Returns a viscoelastic block under the plate, compressible and without friction at its sides.
fn block(head: &str, contact: &str) -> String {
    let material =
        "shear_modulus = 1e4\nprony = [{ relative_modulus = 0.5, relaxation_time = 0.3 }]";
    pressed(head, contact).replace("inf", "2e4").replace("shear_modulus = 1e4", material)
        + &format!("[integrator]\nrtol = {RTOL:e}\n")
}

fn run(text: &str, probes: [&str; 2]) -> [Table; 2] {
    tables_in(text, Path::new(""), probes)
}

/// Checks that a plate with a force has the same pressure and creep as a traction, because the block is homogeneous.
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

/// Returns a block under a ball with a force that rises slowly.
fn ball(head: &str, bulk_modulus: &str) -> String {
    let text = pressed(head, &format!("force = {RAMP}\ndirection = [0.0, -1.0]"));
    text.replace("inf", bulk_modulus).replace("cells = [6, 3]", "cells = [2, 1]").replace(
        "type = \"plane\"\npoint = [0.0, 0.01]\nnormal = [0.0, -2.0]",
        "type = \"sphere\"\ncenter = [0.0, 0.021]\nradius = 0.01",
    ) + "[[probe]]\nname = \"energy\"\ntype = \"energy\"\n"
}

/// Checks that the ball indents the block in a motion as deeply as in an equilibrium, even with inertia: in all formulations, by
/// both methods, and with chains whose feedback is too weak to matter.
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
        // In 0.6 s after the rise, the damping exp(−20 t) reduces the vibration to at most this fraction. The guide
        // expects errors of at least 10 tolerances of BDF.
        let vibration = (-20.0_f64 * 0.6).exp();
        assert!(error.abs() < rtol + vibration, "{formulation} {method}: {error:e}");
        assert!(
            work > 0.0 && imbalance < if method == "bdf" { 10.0 * rtol } else { rtol } * work,
            "{formulation} {method}: {imbalance:e} {work:e}"
        );
    }
}

/// Checks that a fit of the depth in time is rejected, because the depth has no derivatives.
#[test]
fn sensitivities_of_motions_need_given_displacements() {
    let text =
        pressed("[time]\nend = 1.0\n", "force = 1.0\ndirection = [0.0, -1.0]\nstiffness = 1e8");
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let (feature, key) = unsupported(&scene).unwrap();
    assert_eq!((feature, &*key), (Unsupported::ObstacleForce, "contact[0].force"));
}

/// Checks that friction is rejected, which needs the velocity of the obstacle, and a response, which needs its
/// stiffness.
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

const STATIC: &str = "analysis = \"static\"\n";
const MOVED: &str = "y = -0.002";

/// Regression: a plane whose normal points away from the body had no force, and a note depended on rounding.
#[test]
fn an_obstacle_on_the_wrong_side_of_its_group_is_refused() {
    let plane = "type = \"plane\"\npoint = [0.0, 0.01]\nnormal = [0.0, -2.0]";
    let key = |group: &str, shape: &str| {
        let text = pressed(STATIC, MOVED);
        let text = text.replace("group = \"top\"", &format!("group = \"{group}\""));
        let text = text.replace(plane, shape);
        let found = Scene::build("scene.toml", &text, &[], Path::new(""));
        found.err().map(|error| error.to_string().contains("normal = ["))
    };
    let away =
        |x: f64, y: f64| format!("type = \"plane\"\npoint = [0.0, 0.01]\nnormal = [{x}, {y}]");
    for (x, y) in [(0.0, 1.0), (0.7, 1.0), (-0.7, 1.0), (1e-9, 3.0)] {
        assert_eq!(key("top", &away(x, y)), Some(true), "{x}, {y}");
        assert_eq!(key("top", &away(-x, -y)), None, "{x}, {y}");
    }
    // A wall may bulge against a perpendicular plane.
    assert_eq!(key("right", plane), None);
    let ball = |y: f64| format!("type = \"sphere\"\ncenter = [0.0, {y}]\nradius = 0.005");
    assert_eq!(key("top", &ball(0.015)), None);
    assert_eq!(key("top", &ball(-0.005)), Some(false));
}

/// Checks that the displacement at t = 0 decides on which side of the group an obstacle is.
#[test]
fn a_displacement_at_the_start_places_an_obstacle() {
    let plane = "type = \"plane\"\npoint = [0.0, 0.01]\nnormal = [0.0, -2.0]";
    let is_refused = |center: f64, displacement: f64| {
        let ball = format!("type = \"sphere\"\ncenter = [0.0, {center}]\nradius = 0.005");
        let text = pressed("[time]\nend = 0.1\n", &format!("y = {displacement}"));
        Scene::build("scene.toml", &text.replace(plane, &ball), &[], Path::new("")).is_err()
    };
    let (above, below) = (0.015, -0.005);
    for (center, end) in [(above, above), (above, below), (below, above), (below, below)] {
        assert_eq!(is_refused(center, end - center), end == below, "{center} to {end}");
    }
}

/// Regression: the recommended remedies did not help if an obstacle was inside the body at rest.
#[test]
fn an_obstacle_in_the_unloaded_body_is_named_and_can_be_moved_in() {
    let within = pressed(STATIC, "").replace("point = [0.0, 0.01]", "point = [0.0, 0.008]");
    let scene = Scene::build("scene.toml", &within, &[], Path::new("")).unwrap();
    let out = tempfile::tempdir().unwrap();
    let failed = compute(&scene, &RunOptions::into_folder(out.path()));
    match failed.unwrap_err() {
        Error::Model(ModelError::NoEquilibrium { reached, remedy, .. }) => {
            assert_eq!(reached, 0.0);
            assert!(remedy.contains("`top`") && remedy.contains("2.00e-3 m"), "{remedy}");
        }
        other => panic!("{other}"),
    }
    let [plate] = tables_in(&pressed(STATIC, MOVED), Path::new(""), ["plate"]);
    assert!(last(&plate, "F_y") < 0.0);
}

/// Regression: an interrupted path ended with a row of an equilibrium whose multipliers were not converged.
#[test]
fn all_states_of_an_interrupted_path_have_converged_multipliers() {
    static FLAG: AtomicBool = AtomicBool::new(false);
    let mut partial = 0;
    for count in 1..60 {
        let contact = format!("{MOVED}\nmethod = \"augmented-lagrange\"\nstiffness = 4e7");
        let text = pressed(&format!("{STATIC}[static]\nsteps = 4\n"), &contact);
        let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
        let out = tempfile::tempdir().unwrap();
        FLAG.store(false, Ordering::Relaxed);
        let options = RunOptions {
            interrupt: Some(&FLAG),
            progress: &Interrupt(AtomicU32::new(count), &FLAG),
            ..RunOptions::into_folder(out.path())
        };
        let Ok(run) = compute(&scene, &options) else {
            continue;
        };
        let table = fs::read_to_string(out.path().join("plate.csv")).unwrap();
        let table = Table::parse(&table).unwrap();
        let depths = column(&table, "penetration");
        // The first two rows are the unloaded body and the first state, which is kept in any case.
        partial += u32::from(run.document["outcome"] != "finished" && depths.len() > 2);
        let after = depths.iter().skip(2);
        // The facets have a length of 0.02/6 m; the criterion is a ten-thousandth of this length.
        assert!(after.into_iter().all(|depth| *depth <= 1e-4 * 0.02 / 6.0), "{count}: {depths:?}");
    }
    assert!(partial > 0);
}

/// Checks that an invalid force of an obstacle gives an error with the line of the key.
#[test]
fn forces_of_obstacles_are_checked() {
    let head = "analysis = \"static\"\n";
    let full = "force = 1.0\ndirection = [0.0, -1.0]";
    let build = |head: &str, contact: &str| {
        Scene::build("scene.toml", &pressed(head, contact), &[], Path::new(""))
    };
    assert!(build(head, full).is_ok());
    for (head, contact, line) in [
        (head, "force = 1.0", "[[contact]]"),
        (head, "direction = [0.0, -1.0]", "direction = [0.0, -1.0]"),
        (head, "force = 1.0\ndirection = [0.0, 0.0]", "direction = [0.0, 0.0]"),
        (head, "force = 1.0\ndirection = [0.0, 1.0]", "direction = [0.0, 1.0]"),
        (head, "force = 1.0\ndirection = [1.0]", "direction = [1.0]"),
        (head, "force = -1.0\ndirection = [0.0, -1.0]", "force = -1.0"),
        (head, "force = 1.0\ndirection = [0.0, -1.0]\ny = 0.1", "y = 0.1"),
    ] {
        let error = build(head, contact).unwrap_err().to_string();
        assert!(error.contains(&format!(" | {line}")), "{contact}: {error}");
    }
}

/// Checks that a disk in front of the group may move toward it, but not away from it, because its far side would touch
/// the body from inside. Regression: a disk that touches the group except for rounding to six digits was refused.
#[test]
fn a_disk_that_moves_away_is_refused() {
    let disk = |center: f64, direction: f64| {
        let contact = format!("force = 1.0\ndirection = [0.0, {direction:?}]");
        let shape = format!("type = \"sphere\"\ncenter = [0.01, {center:?}]\nradius = 0.005");
        let text = pressed("analysis = \"static\"\n", &contact)
            .replace("type = \"plane\"\npoint = [0.0, 0.01]\nnormal = [0.0, -2.0]", &shape);
        Scene::build("scene.toml", &text, &[], Path::new(""))
    };
    for center in [0.015, 0.015 - 5e-9] {
        assert!(disk(center, -1.0).is_ok(), "{center}");
        let error = disk(center, 1.0).unwrap_err().to_string();
        assert!(error.contains("direction = [0.0, 1.0]"), "{error}");
    }
}

/// Checks that a contact that is incompatible with the mesh gives one error, with its key.
#[test]
fn obstacles_that_do_not_fit_are_rejected() {
    let text = pressed("[time]\nend = 1.0\n", "");
    for (set, key) in [
        ("contact[0].normal=[0.0,0.0]", "contact[0].normal"),
        ("contact[0].point=[0.0,0.0,1.0]", "contact[0].point"),
        ("contact[0].z=1.0", "contact[0].z"),
        ("contact[0].group=\"nowhere\"", "contact[0].group"),
        ("contact[0].stiffness=-1.0", "contact[0].stiffness"),
        ("probe[0].group=\"left\"", "probe[0].group"),
    ] {
        let error =
            Scene::build("scene.toml", &text, &[set.to_owned()], Path::new("")).unwrap_err();
        assert!(error.to_string().contains(key), "{set}: {error}");
    }
}

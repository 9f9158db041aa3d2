//! Scenes in 3D: comparison with equilibria of an independent program, and error messages.
#![allow(clippy::unwrap_used)] // a test may panic

mod cubes;
mod extruded;
mod refusals;

use std::path::Path;

use myovib_model::statics::equilibrium;
use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};
use serde_json::Value;

/// A block of twelve tetrahedra, fixed at its left end.
const BLOCK: &str = r#"
analysis = "static"
[mesh]
type = "box"
size = [2.0, 1.0, 1.0]
cells = [2, 1, 1]
[solid]
bulk_modulus = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
c01 = 2e2
[[fixed]]
group = "left"
[[traction]]
group = "right"
z = 100.0
[[probe]]
name = "end"
type = "point"
at = [2.0, 0.5, 0.5]
[[probe]]
name = "support"
type = "reaction"
group = "left"
"#;

fn results(scene: &Scene) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let result = compute(scene, &RunOptions::into_folder(folder.path())).unwrap();
    result.document["results"].clone()
}

/// Checks case s12 with results of an independent program on the same mesh, with a quadrature of degree 4.
#[test]
fn a_spindle_in_equilibrium_is_that_of_another_program() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/meshes");
    for (kappa, u_z, p) in
        [("1e5", 1.494787223207e-3, -13.39663367314), ("inf", 1.385248872204e-3, -13.44158205485)]
    {
        let text = BLOCK
            .replace("type = \"box\"", "type = \"file\"\npath = \"spindle_coarse.msh\"")
            .replace("size = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]", "")
            .replace("bulk_modulus = 1e5", &format!("bulk_modulus = {kappa}"))
            .replace("group = \"left\"", "group = \"fixed\"")
            .replace("group = \"right\"", "group = \"load\"")
            .replace("at = [2.0, 0.5, 0.5]", "at = [0.0, 0.0, 0.0]");
        let scene = Scene::build("scene.toml", &text, &[], &folder).unwrap();
        let results = results(&scene);
        let end = |name: &str| results["end"][name].as_f64().unwrap();
        // Different quadrature rules of degree 4 lead to differences of 2e-9.
        assert!((end("u_z") / u_z - 1.0).abs() < 1e-8, "{results}");
        assert!((end("p") / p - 1.0).abs() < 1e-7, "{results}");
        // The supports balance the load: 100 Pa on the patch, along z only.
        let support = |name: &str| results["support"][name].as_f64().unwrap();
        let load = support("R_z").abs();
        assert!(load > 0.0 && support("R_x").abs() < 1e-8 * load, "{results}");
    }
}

#[test]
fn the_supports_of_a_block_carry_its_load() {
    let scene = Scene::build("scene.toml", BLOCK, &[], Path::new("")).unwrap();
    let results = results(&scene);
    let support = |name: &str| results["support"][name].as_f64().unwrap();
    // The load is 100 Pa on 1 m². The Newton iteration ends at 1e-9 of the displacement.
    assert!((support("R_z") + 100.0).abs() < 1e-6, "{results}");
    assert!(support("R_x").abs() < 1e-6 && support("R_y").abs() < 1e-6);
    assert_eq!(results["end"].as_object().unwrap().len(), 4, "u_x, u_y, u_z, p");
}

/// Checks that the advice about collapsing elements names the law that does not collapse.
#[test]
fn collapsed_guccione_elements_are_reported_with_the_remedy() {
    let text = BLOCK
        .replace("mooney-rivlin", "guccione")
        .replace("c10 = 1e4\nc01 = 2e2", "c = 2e3\nb_f = 8\nb_t = 2\nb_fs = 4\nfiber = [1, 0, 0]")
        .replace("z = 100.0", "z = 1e19");
    let of = |text: &str| {
        let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
        let body = scene.body.as_ref().unwrap();
        let found = equilibrium(&body.muscle, body.formulation, 0.0);
        found.expect_err("so large a load").to_string()
    };
    assert!(of(&text).contains("`isochoric-guccione`"), "{}", of(&text));
    let other = text.replace("\"guccione\"", "\"isochoric-guccione\"");
    assert!(of(&other).contains("a damped motion"), "{}", of(&other));
    // Regression: one such element suppressed the advice about the limit load of other elements.
    let text = text.replace("[[material]]", "[[material]]\ngroup = \"body\"");
    let both = format!(
        "{text}[[region]]\nname = \"core\"\ncenter = [0.5, 0.5, 0.5]\nradii = [0.4, 0.4, 0.4]\n\
         [[material]]\ngroup = \"core\"\nlaw = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2\n"
    );
    for remedy in ["use `isochoric-guccione`", "a damped motion"] {
        assert!(of(&both).contains(remedy), "{}", of(&both));
    }
}

/// Checks case s10 with half as many cells along the beam as in the scene. Another P2–P1 program gives 3.141 mm with
/// twenty cells along.
#[test]
fn a_beam_of_fibers_bends_as_in_another_program() {
    let set = ["mesh.cells=[20,2,2]".to_owned()];
    let scene = Scene::built_in("land1", &set).unwrap();
    let results = results(&scene);
    let u_z = results["tip"]["u_z"].as_f64().unwrap();
    // The value has four digits.
    assert!((u_z - 3.141e-3).abs() < 1e-6, "{results}");
}

/// Checks the accepted range of case s10, 3.17 ± 0.02 mm, on the scene's mesh with 20 465 unknowns and forty cells
/// along the beam.
#[test]
fn land1_is_within_the_codes_of_the_benchmark() {
    let scene = Scene::built_in("land1", &[]).unwrap();
    let results = results(&scene);
    let u_z = results["tip"]["u_z"].as_f64().unwrap();
    assert!((u_z - 3.17e-3).abs() < 2e-5, "{results}");
    // Another P2–P1 program has this result with the same number of cells, to four digits.
    assert!((u_z - 3.159e-3).abs() < 1e-6, "{results}");
}

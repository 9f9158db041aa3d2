//! Chains in the elements of a group: what is driven, written and refused.
#![allow(clippy::unwrap_used)] // a test may panic

use std::path::Path;

use myovib_dae::Problem;
use myovib_model::MuscleDae;
use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};

const SCENE: &str = r#"
[time]
end = 0.06
[mesh]
type = "muscle3d"
cells = [10, 2, 2]
[solid]
kappa = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
[[fixed]]
group = "left"
[[traction]]
group = "right"
y = { type = "step", value = 100.0, rise = 0.03 }
[[chain]]
name = "spindles"
at = { elements = "muscle" }
oscillators = 4
half_width = 2.0
gain = 4e5
[fields]
every = 0.06
quantities = ["u"]
[[probe]]
name = "all"
type = "coherence"
chain = "spindles"
every = 0.06
"#;

fn refusal(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    let text = SCENE.replacen(from, to, 1);
    match Scene::build("scene.toml", &text, &[], Path::new("")) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn each_element_of_a_group_has_a_chain_with_its_own_frequencies() {
    let scene = Scene::build("scene.toml", SCENE, &[], Path::new("")).unwrap();
    let body = scene.body.as_ref().unwrap();
    let space = body.muscle.solid.space();
    let elements = scene.chains[0].elements.clone().unwrap();
    let (places, omega) = (elements.len(), &scene.chains[0].chain.omega);
    assert!(places > 10 && places < space.n_elements(), "{places}");
    assert_eq!(omega.len(), 4 * places);
    // One seed over all places: the frequencies of a single chain are the first.
    let single = SCENE.replacen("{ elements = \"muscle\" }", "[0.0, 0.0, 0.0]", 1);
    let single = Scene::build("scene.toml", &single, &[], Path::new("")).unwrap();
    assert_eq!(omega[..4], single.chains[0].chain.omega);
    assert!(omega[4..8] != omega[..4]);

    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions::into_folder(folder.path());
    let document = compute(&scene, &options).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    let n = MuscleDae::new(body.muscle.clone(), body.formulation)
        .unwrap()
        .n_unknowns();
    assert_eq!(document["unknowns"], n + 2 * 4 * places);
    let text = std::fs::read_to_string(folder.path().join("fields_00001.vtu")).unwrap();
    let field = myovib_scene::vtu::cell_field(&text, "coherence_spindles").unwrap();
    assert_eq!(field.len(), space.n_elements());
    let inside: Vec<f64> = elements.iter().map(|&e| field[e]).collect();
    assert!(
        inside.iter().all(|chi| (0.0..=1.0 + 1e-12).contains(chi)),
        "{inside:?}"
    );
    assert!(inside.iter().any(|chi| *chi > 0.5), "{inside:?}");
    let without = field.iter().filter(|chi| chi.is_nan()).count();
    assert_eq!(without, space.n_elements() - places);
}

#[test]
fn chains_without_elements_are_refused() {
    let feedback =
        "[[feedback]]\nchain = \"spindles\"\ngroup = \"muscle\"\nunsynchronised = 1.5\n[fields]";
    for (from, to, messages) in [
        (
            "elements = \"muscle\"",
            "elements = \"muscles\"",
            ["muscles", "muscle"],
        ),
        (
            "elements = \"muscle\"",
            "elements = \"left\"",
            ["left", "holds no tetrahedra"],
        ),
        (
            "oscillators = 4",
            "oscillators = 900000",
            ["too many oscillators", "of all places"],
        ),
        ("[fields]", feedback, ["in many elements", "at a point"]),
    ] {
        let found = refusal(from, to);
        for message in messages {
            assert!(found.contains(message), "{to}: {found}");
        }
    }
}

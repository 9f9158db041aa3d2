//! Checks that a motion has no extra cost if its scene also describes a response and a periodic state.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};
use serde_json::Value;

const SCENE: &str = r#"[mesh]
type = "beam"
length = 0.1
height = 0.02
cells = [4, 1]
[time]
end = 0.02
[solid]
bulk_modulus = 1e5
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 1e4
[[fixed]]
group = "fixed"
[[traction]]
group = "load"
y = { type = "sine", amplitude = 1.0, frequency = 8.0 }
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.0]
"#;

const RESPONSE: &str = "traction[0].response={ y = 1.0 }";

/// Returns the counters of a motion and the table of its probe.
fn motion(set: &[&str]) -> (Vec<Value>, String) {
    let out = tempfile::tempdir().unwrap();
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    let scene = Scene::build("scene.toml", SCENE, &set, Path::new("")).unwrap();
    let document = compute(&scene, &RunOptions::into_folder(out.path())).unwrap().document;
    let counters = ["steps", "newton_iterations", "residual_evaluations", "work", "output_work"];
    let counters = counters.map(|key| {
        assert!(!document[key].is_null(), "{key}");
        document[key].clone()
    });
    let table = std::fs::read_to_string(out.path().join("tip.csv")).unwrap();
    (counters.to_vec(), table)
}

#[test]
fn a_motion_pays_nothing_for_a_response_and_a_periodic_state() {
    let alone = motion(&[]);
    let both = [
        RESPONSE,
        "response={ frequencies = \"1..60:adaptive\", fields = [3.0] }",
        "periodic={ settling_periods = 5 }",
    ];
    assert_eq!(motion(&both), alone);
}

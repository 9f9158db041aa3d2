//! Wall-clock times of the parts of a run in its document.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};

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

#[test]
fn parts_of_the_integration_add_up_to_its_time() {
    for method in ["bdf", "radau5"] {
        let out = tempfile::tempdir().unwrap();
        let set = [format!("integrator.method=\"{method}\"")];
        let scene = Scene::build("scene.toml", SCENE, &set, Path::new("")).unwrap();
        let document = compute(&scene, &RunOptions::into_folder(out.path())).unwrap().document;
        let part = |key: &str| document["wall_seconds_by_part"][key].as_f64().unwrap();
        let computed = ["residuals", "tangents", "factorizations", "solves"].map(part);
        assert!(computed.iter().all(|&seconds| seconds > 0.0), "{method}: {computed:?}");
        assert!(part("setup") > 0.0 && part("output") > 0.0, "{method}");
        let total = computed.iter().sum::<f64>() + part("other") + part("output");
        let whole = document["wall_seconds"].as_f64().unwrap();
        // Each time is rounded to 1 ns.
        assert!((total - whole).abs() < 1e-8, "{method}: {total} instead of {whole}");
    }
}

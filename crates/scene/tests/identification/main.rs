//! Parameters of scenes: derivatives of equations and outputs, and fits to measurements.
#![allow(clippy::unwrap_used)] // a test may panic

mod bad_input;
mod chains;
mod derivatives;
mod doubts;
mod fits;
mod index3;
mod interruption;
mod maps;
mod ogden;
mod precision;
mod slow_loading;
mod starts;

use std::path::{Path, PathBuf};

use myovib_scene::fit::{FitOptions, Loss};
use myovib_scene::run::Existing;

/// Writes a short motion of the built-in muscle with these parameters to `folder`.
fn scene(folder: &Path, parameters: &[&str], more: &str) -> PathBuf {
    let text = include_str!("../../../../data/scenes/init.toml");
    // Fields are not needed.
    let (text, _) = text.split_once("[fields]").unwrap();
    // The tolerances below were derived for this formulation.
    let text = text.replacen("[solid]", "[solid]\nformulation = \"rate\"", 1);
    let keys = parameters.iter().map(|key| format!("[[parameter]]\nkey = \"{key}\"\n"));
    let text = format!("{text}\n{}\n{more}\n", keys.collect::<String>());
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// Overrides for a coarse cantilever instead of the muscle, observed at its center.
const SMALL: [&str; 3] = [
    "mesh={ type = \"beam\", length = 0.1, height = 0.03, cells = [5, 2] }",
    "material[0].group=body",
    "probe[0].at=[0.05, 0.0]",
];

/// Overrides as typed.
fn set(overrides: &[&str]) -> Vec<String> {
    overrides.iter().map(|text| (*text).to_owned()).collect()
}

/// Returns the options of a fit of the scene to experiments, each with its own overrides.
fn options<'a>(scene: PathBuf, experiments: Vec<(PathBuf, Vec<String>)>) -> FitOptions<'a> {
    FitOptions {
        out: scene.with_file_name("fit"),
        scene,
        set: Vec::new(),
        experiments,
        existing: Existing::Overwrite,
        tolerance: 1e-5,
        max_iterations: 30,
        starts: 1,
        seed: 0,
        loss: Loss::Squares,
        profile: false,
        interrupt: None,
        progress: &(),
    }
}

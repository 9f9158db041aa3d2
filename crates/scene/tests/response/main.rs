//! Harmonic response of scenes against closed forms and independent finite elements.
#![allow(clippy::unwrap_used)] // a test may panic

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::response::Response;
use myovib_scene::watch::Watcher;
use num_complex::Complex64;
use serde_json::Value;

mod adaptive;
mod assignment;
mod continuation;
mod fields;
mod fits;
mod muscle;
mod notes;
mod periodic;
mod published;
mod ratios;
mod refusals;
mod rod;
mod settled;
mod shear;
mod strip;
mod unused;
mod waves;

/// Returns a reference result from `data/references`.
fn reference(name: &str) -> Value {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/references");
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// Builds a scene whose files are in `data/meshes`.
fn scene_of(text: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/meshes");
    let scene = Scene::build("scene.toml", text, &[], &folder);
    scene.unwrap_or_else(|error| panic!("{error}"))
}

fn response_of(scene: &Scene) -> Response {
    Response::of_scene(scene, Watcher::NOBODY).unwrap()
}

/// Computes the response of a scene whose files are in `data/meshes`.
fn response(text: &str) -> Response {
    response_of(&scene_of(text))
}

/// Returns the amplitudes of a column for all frequencies.
fn column(found: &Response, probe: &str, column: &str) -> Vec<Complex64> {
    let curves = found.probes.iter().find(|curves| curves.name == probe);
    let curves = curves.unwrap();
    let k = curves.columns.iter().position(|name| name == column);
    let k = k.unwrap();
    curves.amplitudes.iter().map(|row| row[k]).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Returns the lines for the solid and for the material that define one of the damping cases.
fn damping(name: &str) -> [&'static str; 2] {
    match name {
        "plain" => ["", ""],
        "eta5" => ["", "viscosity = 5.0"],
        "prony" => ["", "prony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }]"],
        "beta1e-4" => ["rayleigh_stiffness = 1e-4", ""],
        "springpot" => ["", "springpot = { modulus = 3000.0, viscosity = 1.0, exponent = 0.3 }"],
        other => panic!("{other}"),
    }
}

/// Returns |found − expected| / |expected|.
fn error(found: Complex64, expected: Complex64) -> f64 {
    (found - expected).norm() / expected.norm()
}

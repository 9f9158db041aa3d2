//! Notes on responses without damping and on ranges that do not contain the resonance.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::response::Response;
use myovib_scene::watch::Watcher;

use crate::refusals::SCENE;

/// Returns the number of notes of a beam with resonances at 2.0 and 10.3 Hz.
fn notes(frequencies: &str, set: &str) -> usize {
    let frequencies = format!("response.frequencies=\"{frequencies}\"");
    let scene = Scene::build("scene.toml", SCENE, &[frequencies, set.to_owned()], Path::new(""));
    let found = Response::of_scene(&scene.unwrap(), Watcher::NOBODY).unwrap();
    found.notes.len()
}

const DAMPED: &str = "solid.rayleigh_mass=5.0";

#[test]
fn a_resonance_outside_the_range_is_noted() {
    assert_eq!(notes("0..20:41", DAMPED), 0);
    assert_eq!(notes("1..20:adaptive", DAMPED), 0);
    for outside in ["0..1:5", "3..8:6"] {
        assert_eq!(notes(outside, DAMPED), 1, "{outside}");
    }
    // A single frequency has no range.
    assert_eq!(notes("3", DAMPED), 0);
}

#[test]
fn a_body_without_damping_is_noted() {
    for (set, expected) in [
        ("solid.rayleigh_mass=0.0", 1),
        ("solid.rayleigh_stiffness=1e-4", 0),
        ("material[0].viscosity=1.0", 0),
        ("material[0].prony=[{ relative_modulus = 0.3, relaxation_time = 0.05 }]", 0),
        ("material[0].springpot={ modulus = 3e3, viscosity = 1.0, exponent = 0.3 }", 0),
        ("elastic_foundation=[{ group = \"load\", stiffness = 1.0, damping = 10.0 }]", 0),
        ("elastic_foundation=[{ group = \"load\", stiffness = 1.0 }]", 1),
    ] {
        assert_eq!(notes("0..20:41", set), expected, "{set}");
    }
}

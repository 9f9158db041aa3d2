//! Notes on responses without damping and on ranges that do not contain the resonance.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use myovib_scene::Scene;
use myovib_scene::modes::Modes;
use myovib_scene::response::Response;
use myovib_scene::watch::{ProgressSink, Watcher};

use crate::refusals::SCENE;

/// Computes the response of a beam with resonances at 2.0 and 10.3 Hz.
fn response(frequencies: &str, set: &str, watcher: Watcher<'_>) -> Response {
    let frequencies = format!("response.frequencies=\"{frequencies}\"");
    let scene = Scene::build("scene.toml", SCENE, &[frequencies, set.to_owned()], Path::new(""));
    Response::of_scene(&scene.unwrap(), watcher).unwrap()
}

/// Returns the notes of a complete response.
fn notes(frequencies: &str, set: &str) -> Vec<String> {
    response(frequencies, set, Watcher::NOBODY).notes
}

const DAMPED: &str = "solid.rayleigh_mass=5.0";

#[test]
fn a_resonance_outside_the_range_is_noted() {
    // A single frequency has no range.
    for inside in ["0..20:41", "1..20:adaptive", "3"] {
        assert_eq!(notes(inside, DAMPED), Vec::<String>::new(), "{inside}");
    }
    for (outside, end) in [("0..1:5", "`tip.u_y` is largest at 1 Hz"), ("3..8:6", "at 3 Hz")] {
        let found = notes(outside, DAMPED);
        assert!(found.iter().any(|note| note.contains(end)), "{outside}: {found:?}");
    }
}

#[test]
fn modes_below_the_range_are_noted() {
    // The lowest mode is at 1.9992 Hz.
    for (range, below) in [("1..20:77", 0), ("3..20:69", 1)] {
        let found = notes(range, DAMPED);
        let noted = found
            .iter()
            .filter(|note| note.starts_with("1 mode below the range, the first at 1.99"))
            .count();
        assert_eq!(noted, below, "{range}: {found:?}");
    }
}

/// Checks notes on amplitudes, which are proportional to the loads of a linear response.
#[test]
fn displacements_above_the_size_of_the_body_and_large_strains_are_noted() {
    let deflection = |traction: f64| {
        let found = response("0", &format!("traction[0].response.y={traction:?}"), Watcher::NOBODY);
        let note =
            found.notes.iter().find(|note| note.starts_with("the response reaches")).cloned();
        (found.probes[0].amplitudes[0][1].norm(), note)
    };
    let (unit, none) = deflection(1.0);
    assert_eq!(none, None);
    // The largest displacement is at the tip, beside the probe; the body is 0.1 m long.
    let (_, note) = deflection(1.05 * 0.1 / unit);
    assert!(note.is_some_and(|note| note.contains("times the size of the body at 0.0000 Hz")));
    let (_, note) = deflection(0.95 * 0.1 / unit);
    // A cantilever deflected by its length L bends to the strain 3 h / (2 L) = 30 %, averaged over an edge of L / 4.
    assert!(note.is_some_and(|note| note.contains("strains of 2")));
    let (_, none) = deflection(0.2 * 0.1 / unit);
    assert_eq!(none, None);
}

/// Regression: the last frequency before an interrupt counted as an end of the range.
#[test]
fn an_interrupted_response_has_no_note_on_its_range() {
    static INTERRUPT: AtomicBool = AtomicBool::new(false);
    struct AfterThree;
    impl ProgressSink for AfterThree {
        fn on_progress(&self, line: &dyn Fn() -> String) {
            INTERRUPT.fetch_or(line().contains("3 of 41"), Relaxed);
        }
    }
    let watcher = Watcher { interrupt: Some(&INTERRUPT), progress: &AfterThree };
    let found = response("0..20:41", DAMPED, watcher);
    assert!(found.is_interrupted && found.frequencies.len() < 41);
    assert_eq!(found.notes, Vec::<String>::new());
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
        let found = notes("0..20:41", set);
        let noted = found.iter().filter(|note| note.contains("no damping")).count();
        assert_eq!(noted, expected, "{set}: {found:?}");
    }
}

/// A uniform pressure around an incompressible body changes only its internal pressure. If the damping of the
/// vibrations were due to friction, this pressure would not change it.
///
/// Regression: growing vibrations caused no note and had positive damping ratios in the response.
#[test]
fn vibrations_that_damping_increases_are_noted() {
    const STRIP: &str = "analysis = \"response\"\n[mesh]\ntype = \"rectangle\"\nwidth = 0.1\nheight = 0.02\n\
         cells = [4, 1]\n[solid]\nbulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
         shear_modulus = 1e4\n[[fixed]]\ngroup = \"left\"\n[[traction]]\ngroup = \"right\"\nresponse = { y = 1.0 }\n\
         [[pressure]]\ngroup = \"right\"\nvalue = 5e3\n[[pressure]]\ngroup = \"top\"\nvalue = 5e3\n[[pressure]]\n\
         group = \"bottom\"\nvalue = 5e3\n[response]\nfrequencies = \"1..10:10\"\npreload_time = 0.0\n[[probe]]\n\
         name = \"tip\"\ntype = \"point\"\nat = [0.1, 0.0]\nquantities = [\"u\"]\n[modes]\npreload_time = 0.0\n";
    for (damping, grows) in
        [("solid.rayleigh_stiffness=1e-3", true), ("material[0].viscosity=10.0", false)]
    {
        let scene =
            Scene::build("scene.toml", STRIP, &[damping.to_owned()], Path::new("")).unwrap();
        let modes = Modes::of_scene(&scene, Some(2), Watcher::NOBODY).unwrap();
        let body = &modes.muscles[0];
        assert_eq!(body.modes[0].damping_ratio.unwrap() < 0.0, grows);
        let response = Response::of_scene(&scene, Watcher::NOBODY).unwrap();
        for notes in [&body.notes, &response.notes] {
            assert_eq!(notes.iter().any(|note| note.contains("rayleigh_stiffness")), grows);
        }
    }
}

//! Checks that invalid parameters, measurements and bounds are rejected before anything is computed.

use myovib_scene::fit::{FitOptions, Loss, compute};
use myovib_scene::run::Existing;
use myovib_scene::sensitivity::{
    Parameterized, Precision, Unsupported, compute as follow, unsupported,
};
use myovib_scene::watch::Watcher;
use myovib_scene::{Error, Scene};

use crate::{scene, set};

fn of_scene(parameters: &[&str], more: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), parameters, more);
    match Parameterized::load(&path, &[]) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// A round region that contracts.
const ACTIVE: &str = "[[region]]\nname = \"r\"\ncenter = [0, 0]\nradii = [0.02, 0.02]\n[[material]]\n\
                      group = \"r\"\nlaw = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\n\
                      fiber = [1, 0]\nactive = { type = \"bestel\", contractility = 1e4 }";

/// A round region with a `neo-hooke` law, which is converted to mooney-rivlin.
const NEO_HOOKE: &str = "[[region]]\nname = \"r\"\ncenter = [0, 0]\nradii = [0.02, 0.02]\n[[material]]\n\
                         group = \"r\"\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 2e4";

#[test]
fn invalid_keys_of_parameters_are_refused_with_their_place() {
    for (keys, more, reported) in [
        (&["material[0].c20"][..], "", "allowed: c01, c10, density, stress_scale"),
        (&["material[1].c10"], NEO_HOOKE, "allowed: density, shear_modulus, stress_scale"),
        (&["material[1].shear_modulus"], NEO_HOOKE, "accepted"),
        (&["material[1].stress_scale"], NEO_HOOKE, "accepted"),
        (&["material[7].c10"], "", "the scene has no numeric key `material[7].c10`"),
        (&["mesh.refine"], "", "`mesh.refine` cannot be a parameter"),
        (&["traction[0].y"], "", "a table with "),
        (&[], "", "the scene defines no parameters"),
        (&["material[0].c10", "material.0.c10"], "", "duplicate parameter `material[0].c10`"),
        (&["chain[0].seed"], "[[chain]]\n", "`chain[0].seed` cannot be differentiated"),
        (
            &["prescribed_displacement.0.x.value"],
            "[[chain]]\n[[prescribed_displacement]]\ngroup = \"load\"\nx = { type = \"step\", value = 0.1, rise = 0.1 }\n",
            "may drive a chain",
        ),
        (
            &["traction[1].y.end"],
            "[[traction]]\ngroup = \"load\"\ny = { type = \"ramp\", value = 1.0, start = 0.1, end = 0.2 }",
            "`rise` above 0",
        ),
        (
            &["traction[1].y.start"],
            "[[traction]]\ngroup = \"load\"\ny = { type = \"step\", value = 1.0, start = 0.1, rise = 0 }",
            "load",
        ),
        (
            &["prescribed_displacement[0].y.rise"],
            "[[prescribed_displacement]]\ngroup = \"load\"\ny = { type = \"step\", value = 1e-3, rise = 0.1 }",
            "acceleration",
        ),
        (
            &["traction[1].y.rise", "traction[1].y.start"],
            "[[traction]]\ngroup = \"load\"\ny = { type = \"step\", value = 1.0, rise = 0.1 }",
            "accepted",
        ),
        (&["material[1].active.systole"], ACTIVE, "`contractility`"),
        (&["material[1].active.width"], ACTIVE, "cannot be differentiated"),
        (&["solid.beta2"], "", "the scene has no numeric key `solid.beta2`"),
        (&["time.end"], "", "numbers of solid, material"),
        (
            &["initial_state.value"],
            "[initial_state]\ntype = \"velocity\"\nvalue = [0.1, 0.0]",
            "choose an entry, as in `initial_state.value[0]`",
        ),
        (
            &["initial_state.value[1]"],
            "[initial_state]\ntype = \"velocity\"\nvalue = [0.1, 0.0]",
            "add `scale`, a typical size",
        ),
        (&["material[0].c10"], "", "accepted"),
    ] {
        let found = of_scene(keys, more);
        assert!(found.contains(reported), "{keys:?}: {found}");
        assert!(keys.is_empty() || reported == "accepted" || found.contains("line "), "{found}");
    }
}

/// Checks initial states whose derivatives are not available. For finite κ the given initial velocity is used
/// unchanged; for κ = inf it is projected onto velocities without volume change.
#[test]
fn starts_without_derivatives_are_rejected_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let moving = "[initial_state]\ntype = \"velocity\"\nvalue = [0.1, 0.0]";
    let path = scene(folder.path(), &["solid.bulk_modulus"], moving);
    let of_scene = ["solid.bulk_modulus=inf", "parameter[0].scale=1e-5"];
    let it = Parameterized::load(&path, &set(&of_scene)).unwrap();
    let message = it.dependences(&it.values()).unwrap_err().to_string();
    for part in
        ["has no derivative with respect to 1/bulk_modulus", "key = \"solid.bulk_modulus\"", "1e7"]
    {
        assert!(message.contains(part), "{message}");
    }
    assert!(it.dependences(&[1e-7]).is_ok());
}

/// Checks moduli bounded by other constants: with mu_1 = 0 the body would have no stiffness.
#[test]
fn moduli_bounded_by_other_constants_have_derivatives() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].mu_1"], "");
    let ogden = "material[0]={ law = \"ogden\", density = 1e3, mu_1 = -1e4, alpha_1 = -2.0 }";
    let it = Parameterized::load(&path, &set(&[ogden])).unwrap();
    assert!(it.dependences(&it.values()).is_ok());
}

/// Checks the phase of a sine: with other phases, the sine loads the body at t = 0, so that a run from rest cannot
/// start.
#[test]
fn parameters_that_end_the_rest_at_the_start_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let sine = "traction[0].y={ type = \"sine\", amplitude = 9.0, frequency = 8.0 }";
    let path = scene(folder.path(), &["traction[0].y.phase"], "");
    let more = set(&[sine, "parameter[0].scale=1.0"]);
    let it = Parameterized::load(&path, &more).unwrap();
    let message = it.dependences(&it.values()).unwrap_err().to_string();
    for part in [
        "a change in `traction[0].y.phase` would load the body at t = 0",
        "key = \"traction[0].y.phase\"",
        "or start in equilibrium with them",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let from_equilibrium = set(&["initial_state={ type = \"equilibrium\" }"]);
    let it = Parameterized::load(&path, &[more, from_equilibrium].concat()).unwrap();
    assert!(it.dependences(&it.values()).is_ok());
}

/// Checks errors about features that sensitivities do not support, and their locations.
#[test]
fn features_without_sensitivities_are_refused() {
    let jump = |start: &str| {
        format!(
            "[[traction]]\ngroup = \"load\"\n\
             y = {{ type = \"product\", of = [2.0, {{ type = \"step\", value = 1.0, start = {start}, rise = 0 }}] }}"
        )
    };
    let feedback =
        "[[chain]]\nat = [0.0, 0.0]\n[[feedback]]\nchain = \"chain\"\nat_zero_coherence = 0.9\n";
    let tension = "[[chain]]\nat = [0.0, 0.0]\n[[region]]\nname = \"r\"\ncenter = [0, 0]\nradii = [0.02, 0.02]\n\
                   [[material]]\ngroup = \"r\"\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 2e4\n\
                   fiber = [1, 0]\n\
                   active = { type = \"coherence\", chain = \"chain\", at_full_coherence = 1e3 }\n";
    let stop = "[[stop]]\ntype = \"volume\"\nbelow = 0.1";
    for (more, feature, place) in [
        (stop, Unsupported::Stop, "stop"),
        (feedback, Unsupported::Feedback, "feedback"),
        (tension, Unsupported::Feedback, "material[1].active"),
        (&jump("0.01"), Unsupported::Jump, "traction[1].y.of[1]"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = scene(folder.path(), &["material[0].c10"], more);
        let found = unsupported(&Scene::load(&path, &[]).unwrap());
        assert_eq!(found, Some((feature, place.to_owned())));
        assert!(Parameterized::load(&path, &[]).is_err(), "{place}");
    }
    // A jump after the end of the run has no effect.
    assert_eq!(of_scene(&["material[0].c10"], &jump("99.0")), "accepted");
}

/// Returns the error of a fit of `material[0].c10` and `solid.rayleigh_mass`, and checks that nothing has been written.
fn error_of_fit(data: &str, more: &[&str], change: impl FnOnce(&mut FitOptions<'_>)) -> Error {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10", "solid.rayleigh_mass"], "");
    let file = folder.path().join("measured.csv");
    std::fs::write(&file, data).unwrap();
    let out = folder.path().join("fit");
    let mut options = FitOptions {
        scene: path,
        set: set(&[&["time.end=0.02"], more].concat()),
        experiments: vec![(file, Vec::new())],
        out: out.clone(),
        existing: Existing::Refuse,
        tolerance: 1e-5,
        max_iterations: 20,
        starts: 1,
        seed: 0,
        loss: Loss::Squares,
        profile: false,
        interrupt: None,
        progress: &(),
    };
    change(&mut options);
    let error = compute(&options).unwrap_err();
    assert!(!out.exists(), "nothing is written");
    error
}

/// Checks errors about invalid input, and their locations.
#[test]
fn wrong_data_bounds_and_starts_are_refused_with_their_place() {
    let good = "t,origin.u_y\n0.005,0\n0.01,0\n0.02,0\n";
    for (data, more, place) in [
        ("t,origin.u_y\n0.01,0\n0.5,0\n", &[][..], "measured.csv, line 3, column t"),
        ("t,origin.u_y\n0.01,0\n0.02,0\n", &[], "2 measurements, 2 parameters"),
        (good, &["parameter[0].low=2e4"], "parameter[0].low"),
        (good, &["parameter[0].low=-2e4", "parameter[0].start=-1e4"], "material[0].c10"),
        (good, &["parameter[0].low=2", "parameter[0].high=1"], "parameter[0].low"),
        (good, &["parameter[0].low=-1e4"], "parameter[0].low"),
    ] {
        let error = error_of_fit(data, more, |_| ());
        assert!(matches!(error, Error::Input(_)), "{error:?}");
        assert!(error.to_string().contains(place), "{data:?}: {error}");
    }
    let robust = error_of_fit(good, &[], |options| options.loss = Loss::Huber(1.345));
    assert!(matches!(robust, Error::Input(_)), "{robust:?}");
    let many = error_of_fit(good, &[], |options| options.starts = 1_000_000_000_000);
    assert!(matches!(many, Error::Input(_)), "{many:?}");
    assert!(many.to_string().contains("starts"), "{many}");
}

/// Checks that a setting of another method is reported as wrong input, not as a failure of the run.
#[test]
fn settings_that_radau_does_not_have_are_wrong_input() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10"], "");
    let own = ["integrator={ method = \"bdf\", projection_interval = 0.01 }", "time.end=0.02"];
    let it = Parameterized::load(&path, &set(&own)).unwrap();
    let error = follow(&it, Precision::OfMotion, Watcher::NOBODY).unwrap_err();
    assert!(matches!(error, Error::Input(_)), "{error:?}");
}

//! One clear message for each mistake, before anything is computed.

use std::path::Path;

use myovib_scene::fit::{FitOptions, Loss, compute};
use myovib_scene::run::Existing;
use myovib_scene::sensitivity::Parametrised;

use crate::{scene, set};

fn of_scene(parameters: &[&str], more: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), parameters, more);
    match Parametrised::load(&path, &[]) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// A round region that contracts.
const ACTIVE: &str = "[[region]]\nname = \"r\"\ncentre = [0, 0]\nradii = [0.02, 0.02]\n[[material]]\n\
                      group = \"r\"\nlaw = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\n\
                      fibre = [1, 0]\nactive = { type = \"bestel\", contractility = 1e4 }";

/// A round region of another law, which scenes read as mooney-rivlin.
const NEO_HOOKE: &str = "[[region]]\nname = \"r\"\ncentre = [0, 0]\nradii = [0.02, 0.02]\n[[material]]\n\
                         group = \"r\"\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 2e4";

#[test]
fn keys_that_are_no_parameters_are_told_with_their_place() {
    for (keys, more, told) in [
        (
            &["material[0].c20"][..],
            "",
            "allowed: c01, c10, density, stiffness",
        ),
        (
            &["material[1].c10"],
            NEO_HOOKE,
            "allowed: density, stiffness\n    next: give the law as mooney-rivlin",
        ),
        (
            &["material[1].shear_modulus"],
            NEO_HOOKE,
            "next: give the law as mooney-rivlin, of which c10 is half the shear_modulus",
        ),
        (&["material[1].stiffness"], NEO_HOOKE, "accepted"),
        (
            &["material[7].c10"],
            "",
            "the scene has no number `material[7].c10`",
        ),
        (&["mesh.refine"], "", "`mesh.refine` cannot be a parameter"),
        (&["traction[0].y"], "", "a table with "),
        (&[], "", "the scene names no parameter"),
        (
            &["material[0].c10", "material.0.c10"],
            "",
            "`material[0].c10` is a parameter twice",
        ),
        (
            &["material[0].c10"],
            "[[stop]]\ntype = \"volume\"\nbelow = 0.1",
            "move the time at which the run stops",
        ),
        (
            &["chain[0].seed"],
            "[[chain]]\n",
            "`chain[0].seed` cannot be differentiated",
        ),
        (
            &["chain[0].gain"],
            "[[chain]]\nat = [0.0, 0.0]\n[[feedback]]\nchain = \"chain\"\nunsynchronised = 0.9\n",
            "chains that do not act back",
        ),
        (
            &["chain[0].gain"],
            "[[chain]]\nat = [0.0, 0.0]\n[[region]]\nname = \"r\"\ncentre = [0, 0]\nradii = [0.02, 0.02]\n\
             [[material]]\ngroup = \"r\"\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 2e4\nfibre = [1, 0]\n\
             active = { type = \"coherence\", chain = \"chain\", coherent = 1e3 }\n",
            "chains that do not act back",
        ),
        (
            &["displacement.0.x.value"],
            "[[chain]]\n[[displacement]]\ngroup = \"load\"\nx = { type = \"step\", value = 0.1, rise = 0.1 }\n",
            "may drive a chain itself",
        ),
        (
            &["traction[1].y.end"],
            "[[traction]]\ngroup = \"load\"\ny = { type = \"ramp\", value = 1.0, start = 0.1, end = 0.2 }",
            "moves a break of the load\n    next: write the load as a step with a `rise` above 0",
        ),
        (
            &["traction[1].y.start"],
            "[[traction]]\ngroup = \"load\"\ny = { type = \"step\", value = 1.0, start = 0.1, rise = 0 }",
            "moves a break of the load",
        ),
        (
            &["displacement[0].y.rise"],
            "[[displacement]]\ngroup = \"load\"\ny = { type = \"step\", value = 1e-3, rise = 0.1 }",
            "moves a break of the support's acceleration\n    next: keep it fixed",
        ),
        (
            &["traction[1].y.rise", "traction[1].y.start"],
            "[[traction]]\ngroup = \"load\"\ny = { type = \"step\", value = 1.0, rise = 0.1 }",
            "accepted",
        ),
        (
            &["material[1].active.systole"],
            ACTIVE,
            "moves a break of the tension\n    next: keep it fixed; `contractility`",
        ),
        (
            &["material[1].active.width"],
            ACTIVE,
            "cannot be differentiated",
        ),
        (
            &["solid.beta2"],
            "",
            "the scene has no number `solid.beta2`",
        ),
        (&["time.end"], "", "numbers of solid, material"),
        (
            &["start.value"],
            "[start]\ntype = \"velocity\"\nvalue = [0.1, 0.0]",
            "name one of it, as `start.value[0]`",
        ),
        (
            &["start.value[1]"],
            "[start]\ntype = \"velocity\"\nvalue = [0.1, 0.0]",
            "add `scale`, a typical size",
        ),
        (&["material[0].c10"], "", "accepted"),
    ] {
        let found = of_scene(keys, more);
        assert!(found.contains(told), "{keys:?}: {found}");
        assert!(
            keys.is_empty() || told == "accepted" || found.contains("line "),
            "{found}"
        );
    }
}

/// For every finite κ the velocity starts as it is given, for κ = inf without a change of volume.
#[test]
fn starts_without_a_derivative_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let moving = "[start]\ntype = \"velocity\"\nvalue = [0.1, 0.0]";
    let path = scene(folder.path(), &["solid.kappa"], moving);
    let of_scene = ["solid.kappa=inf", "parameter[0].scale=1e-5"];
    let it = Parametrised::load(&path, &set(&of_scene)).unwrap();
    let message = it.dependences(&it.values()).unwrap_err().to_string();
    for part in [
        "has no derivative by 1/kappa",
        "key = \"solid.kappa\"",
        "a large kappa: 1e7",
    ] {
        assert!(message.contains(part), "{message}");
    }
    assert!(it.dependences(&[1e-7]).is_ok());
}

/// Other phases of a sine load the body at t = 0: at rest, no run would start.
#[test]
fn parameters_that_end_the_rest_at_the_start_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let sine = "traction[0].y={ type = \"sine\", amplitude = 9.0, frequency = 8.0 }";
    let path = scene(folder.path(), &["traction[0].y.phase"], "");
    let more = set(&[sine, "parameter[0].scale=1.0"]);
    let it = Parametrised::load(&path, &more).unwrap();
    let message = it.dependences(&it.values()).unwrap_err().to_string();
    for part in [
        "another `traction[0].y.phase` loads the body at t = 0",
        "key = \"traction[0].y.phase\"",
        "or start in equilibrium with them",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let from_equilibrium = set(&["start={ type = \"equilibrium\" }"]);
    let it = Parametrised::load(&path, &[more, from_equilibrium].concat()).unwrap();
    assert!(it.dependences(&it.values()).is_ok());
}

/// Issue 15, A1: a run goes over a jump, its sensitivities do not.
#[test]
fn sensitivities_across_a_jump_are_refused_with_what_to_do() {
    let jumping = |start: &str| {
        let step = format!(
            "[[traction]]\ngroup = \"load\"\n\
             y = {{ type = \"product\", of = [2.0, {{ type = \"step\", value = 1.0, start = {start}, rise = 0 }}] }}"
        );
        of_scene(&["material[0].c10"], &step)
    };
    let message = jumping("0.01");
    for part in [
        "across a jump are not computed",
        "line ",
        "give the step a `rise`",
    ] {
        assert!(message.contains(part), "{message}");
    }
    // Beyond the end of the run.
    assert_eq!(jumping("99.0"), "accepted");
}

fn of_fit(data: &str, more: &[&str], loss: Loss) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10", "solid.alpha"], "");
    let file = folder.path().join("measured.csv");
    std::fs::write(&file, data).unwrap();
    let out = folder.path().join("fit");
    let result = compute(&FitOptions {
        scene: path,
        set: set(&[&["time.end=0.02"], more].concat()),
        experiments: vec![(file, Vec::new())],
        out: out.clone(),
        existing: Existing::Refuse,
        tolerance: 1e-5,
        max_iterations: 20,
        starts: 1,
        seed: 0,
        loss,
        profile: false,
        interrupt: None,
        progress: &(),
    });
    match result {
        Ok(_) => "accepted".to_owned(),
        Err(error) => {
            assert!(!Path::new(&out).exists(), "nothing is written");
            error.to_string()
        }
    }
}

#[test]
fn data_and_bounds_that_make_no_sense_are_told() {
    let good = "t,origin.u_y\n0.005,0\n0.01,0\n0.02,0\n";
    for (data, more, told) in [
        (
            "t,origin.u_y\n0.01,0\n0.5,0\n",
            &[][..],
            "a measurement lies outside of the run",
        ),
        (
            "t,origin.u_y\n0.01,nan\n",
            &[],
            "measurements, times and noise are finite numbers",
        ),
        (
            "t,origin.u_z\n0.01,0\n",
            &[],
            "the scene has no output `origin.u_z`",
        ),
        (
            "t,origin.u_y\n0.01,0\n0.02,0\n",
            &[],
            "more measurements than parameters",
        ),
        (
            good,
            &["parameter[0].low=2e4"],
            "a bound of `material[0].c10` excludes its start",
        ),
        (
            good,
            &["parameter[0].low=-2e4", "parameter[0].start=-1e4"],
            "the scene cannot be computed where the fit starts",
        ),
        (
            good,
            &["parameter[0].low=2", "parameter[0].high=1"],
            "not below the upper one",
        ),
        (
            good,
            &["parameter[0].low=-1e4"],
            "`material[0].c10` cannot go to this bound\n   where: --set parameter[0].low=-1e4",
        ),
    ] {
        let found = of_fit(data, more, Loss::Squares);
        assert!(found.contains(told), "{data:?}: {found}");
    }
    let found = of_fit(good, &[], Loss::Huber(1.345));
    assert!(found.contains("a robust loss needs the noise"), "{found}");
}

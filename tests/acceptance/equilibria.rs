//! Tests of equilibria on the command line: interrupted and failed searches, their stored results, and later runs that
//! use these results.

use std::fs;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::harness::{code_of_interrupted, myovib_in};
use crate::results::read_json;

/// Search for an equilibrium with such a soft fiber that it takes a hundred seconds of small load steps.
const SOFT: [&str; 5] = ["run", "land1", "--quiet", "--set", "material[0].b_f=1e-29"];

/// Changes of a static scene to a motion that starts in equilibrium.
const MOTION: [&str; 6] = [
    "--set",
    "analysis=\"dynamic\"",
    "--set",
    "time.end=1.0",
    "--set",
    "initial_state.type=equilibrium",
];

/// Regression: the search for an equilibrium, which has no time steps, continued for minutes after Ctrl-C.
#[test]
fn ctrl_c_ends_the_search_for_an_equilibrium() {
    let folder = tempfile::tempdir().unwrap();
    let since = Instant::now();
    assert_eq!(code_of_interrupted(folder.path(), &SOFT), Some(130));
    assert!(since.elapsed() < Duration::from_secs(60));
    // The last equilibrium that was found before the signal is kept.
    let document = folder.path().join("out/run.json");
    if document.exists() {
        let document = read_json(&document);
        assert_eq!(document["reason"], "interrupted");
        assert!(document["load_reached"].as_f64().unwrap() < 1.0);
    }
}

/// Checks that the equilibrium of the last load step, which belongs to a partial load, is kept.
#[test]
fn no_equilibrium_is_code_4_and_keeps_the_last_state() {
    let folder = tempfile::tempdir().unwrap();
    let load = 2e4; // three thousand times the load of the scene
    let load_set = format!("traction[0].y={load}");
    myovib_in(folder.path(), &["run", "cook-static", "--quiet", "--set", &load_set]).with_code(4);
    let found = read_json(&folder.path().join("out/run.json"));
    assert_eq!(found["reason"], "no_equilibrium");
    let reached = found["load_reached"].as_f64().unwrap();
    assert!(reached > 0.0 && reached < 1.0, "{reached}");
    // In the kept state, the support carries the traction on the side of length 16. Newton's method ends at increments
    // of 1e-9, and the relative errors of forces are up to κ/G = 5000 times larger.
    let carried = found["results"]["support"]["R_y"].as_f64().unwrap();
    let applied = reached * load * 16.0;
    assert!((carried + applied).abs() <= 5e-6 * applied, "{carried} {applied}");
}

/// Regression: outputs of a partially loaded equilibrium used the full load. The positions of supports had never been
/// reached, so the run ended without an error about the load, and reactions contained the full weight.
#[test]
fn a_part_of_the_load_is_read_off_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let square = "analysis = \"static\"\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [4, 4]\n\
                  [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
                  [[fixed]]\ngroup = \"left\"\n[[probe]]\nname = \"support\"\ntype = \"reaction\"\ngroup = \"left\"\n";
    let reached = |name: &str, loads: &str| -> (f64, Value) {
        let scene = format!("{name}.toml");
        fs::write(folder.path().join(&scene), square.to_owned() + loads).unwrap();
        myovib_in(folder.path(), &["run", &scene, "--quiet", "--out", name]).with_code(4);
        let document = read_json(&folder.path().join(name).join("run.json"));
        let part = document["load_reached"].as_f64().unwrap();
        assert!(part > 0.0 && part < 1.0, "{part}");
        (part, document["results"].clone())
    };
    let end = "[[probe]]\nname = \"end\"\ntype = \"average\"\ngroup = \"right\"\n";
    let crushed =
        format!("[[prescribed_displacement]]\ngroup = \"right\"\nx = -0.97\ny = 0.0\n{end}");
    let (part, results) = reached("crushed", &crushed);
    let u_x = results["end"]["u_x"].as_f64().unwrap();
    // The tolerance is the rounding error of the mean of a constant.
    assert!((u_x + 0.97 * part).abs() < 1e-12, "{u_x} {part}");
    // The mass is 1000 kg and the side has 1 m², per meter of depth. The support carries both loads.
    let (acceleration, traction) = (-50.0, -3e4);
    let weighed = format!(
        "[[body_force]]\nx = {acceleration:e}\n[[traction]]\ngroup = \"right\"\nx = {traction:e}\n"
    );
    let (part, results) = reached("weighed", &weighed);
    let reaction = results["support"]["R_x"].as_f64().unwrap();
    let expected = -part * (1e3 * acceleration + traction);
    // Newton's iteration ends at increments of 1e-9. The remaining error is about the square of this value.
    assert!((reaction / expected - 1.0).abs() < 1e-9, "{reaction} {expected}");
    // A motion that starts from this equilibrium is under the full load.
    let motion = square.replace(
        "analysis = \"static\"",
        "[time]\nend = 0.01\n[initial_state]\ntype = \"restart\"\nfolder = \"weighed\"",
    );
    fs::write(folder.path().join("motion.toml"), motion).unwrap();
    let words = ["run", "motion.toml", "--quiet", "--out", "weighed", "--overwrite"];
    let replaced = myovib_in(folder.path(), &words).with_code(2);
    assert!(replaced.stderr.contains("weighed"), "{}", replaced.stderr);
    let moved = myovib_in(folder.path(), &["run", "motion.toml", "--quiet", "--out", "motion"])
        .with_code(0);
    let reported = format!("reached only {:.1} % of its loads", 100.0 * part);
    assert!(moved.stderr.contains(&reported), "{}", moved.stderr);
    // A sweep also rejects a partially loaded equilibrium as the result of a case.
    let vary = format!("prescribed_displacement[0].x=-0.01,{}", -0.97);
    let sweep = [
        "sweep",
        "crushed.toml",
        "--vary",
        &vary,
        "--result",
        "u=last(end.u_x)",
        "--out",
        "cases",
        "--quiet",
    ];
    myovib_in(folder.path(), &sweep);
    let table = fs::read_to_string(folder.path().join("cases/sweep.csv")).unwrap();
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = rows.next().unwrap();
    let column = names.iter().position(|name| *name == "u").unwrap();
    let values: Vec<&str> = rows.map(|row| row[column]).collect();
    assert_eq!(values.len(), 2, "{table}");
    assert!((values[0].parse::<f64>().unwrap() + 0.01).abs() < 1e-12, "{table}");
    assert_eq!(values[1], "", "{table}");
}

/// Regression: a motion that starts in equilibrium ignored Ctrl-C during the search.
#[test]
fn ctrl_c_ends_the_search_for_an_equilibrium_to_start_from() {
    let folder = tempfile::tempdir().unwrap();
    let since = Instant::now();
    let soft = [&SOFT[..], &MOTION].concat();
    assert_eq!(code_of_interrupted(folder.path(), &soft), Some(130));
    assert!(since.elapsed() < Duration::from_secs(60));
    assert!(!folder.path().join("out").exists());
}

/// Regression: an existing run in the folder was detected only after the search for an equilibrium, which may take
/// minutes.
#[test]
fn a_folder_that_holds_a_run_is_refused_before_an_equilibrium_is_sought() {
    let folder = tempfile::tempdir().unwrap();
    myovib_in(folder.path(), &["run", "cook-static", "--quiet"]).with_code(0);
    // No equilibrium exists under this load.
    let load = ["--set", "traction[0].y=1e19"];
    let second =
        myovib_in(folder.path(), &[&["run", "cook-static"][..], &load].concat()).with_code(2);
    assert!(second.stderr.contains("--overwrite"), "{}", second.stderr);
    assert!(!second.stderr.contains("--resume"), "{}", second.stderr);
    // The same holds if a motion starts in equilibrium.
    let words = [&["run", "cook-static"][..], &load, &MOTION].concat();
    let third = myovib_in(folder.path(), &words).with_code(2);
    assert!(third.stderr.contains("--overwrite"), "{}", third.stderr);
}

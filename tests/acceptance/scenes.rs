//! Tests of scenes: every built-in scene runs, incomplete runs can be continued, and no result is computed twice.

use std::fs;

use myovib_scene::builtin::{BuiltinScene, SCENES};
use serde_json::Value;

use crate::harness::myovib_in;
use crate::results::{self, read_json, run_scene};

/// Runs every scene until its loads have risen. Ramped loads reach half of their amplitude at 0.8 s.
#[test]
fn every_built_in_scene_runs_under_its_load() {
    let folder = tempfile::tempdir().unwrap();
    for BuiltinScene { name, text, .. } in SCENES {
        let end: &[&str] = match *name {
            // With its default mesh, the scene has 184 thousand unknowns.
            "ventricle" => &["time.end=0.05", "mesh.resolution=coarse"],
            "muscle3d" => &["time.end=0.05", "mesh.cells=[10,2,2]"],
            "ventricle-coarse" => &["time.end=0.05"],
            // The scene computes many waves per second.
            "hardening" => &["time.end=0.2"],
            _ if text.contains("[time]") => &["time.end=0.9"],
            _ => &[],
        };
        let document = run_scene(folder.path(), name, name, end);
        assert_eq!(document["outcome"], "finished", "{name}");
        let out = folder.path().join(name);
        assert!(out.join("report.html").exists());
        let tables = fs::read_dir(&out).unwrap().map(|file| file.unwrap().path());
        for table in tables.filter(|path| path.extension().is_some_and(|e| e == "csv")) {
            let (_, rows) = results::read_table(&table);
            let changes = |k: usize| rows.iter().any(|row| row[k] != rows[0][k]);
            let moves = rows.len() == 1 || (1..rows[0].len()).any(changes);
            // Ventricles contract after 0.16 s, which a separate test covers.
            assert!(
                moves || name.starts_with("ventricle"),
                "nothing happens in {}",
                table.display()
            );
        }
    }
}

#[test]
fn a_wrong_scene_is_explained_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (set, message) in [
        ("fixed[0].group=fixd", "did you mean `fixed`?"),
        ("traction[0].group=muscle", "contains triangles"),
        ("pressure=[{ group = \"muscle\", value = 0.0 }]", "contains triangles"),
        ("material[0].group=leg", "the mesh has no group `leg`"),
        ("material[0].group=load", "contains no triangles"),
        ("probe[0].at=[1.0, 0.0]", "outside the mesh"),
        ("solid.formulation=stabilized", "requires β = 0"),
        ("traction[0].y=100.0", "the loads do not start from zero"),
        ("mesh.type=file", "needs `path`"),
        ("fields.interval=0", "out of range"),
        ("region=[{ name = \"r\", center = [0, 0], radii = [-1, 1] }]", "must be positive lengths"),
        (
            "parameter=[{ key = \"material[0].c1\" }]",
            "the scene has no numeric key `material[0].c1`",
        ),
        ("region=[{ name = \"\", center = [0, 0], radii = [1, 1] }]", "a region needs a name"),
    ] {
        let run = myovib_in(folder.path(), &["run", "init", "--out", "out", "--set", set]);
        assert_eq!(run.code, 2, "{set}: {}", run.stderr);
        assert!(run.stderr.contains(message), "{set}: {}", run.stderr);
        assert!(run.stderr.contains("where:") || set.contains("y=100"), "{}", run.stderr);
        assert!(!folder.path().join("out").exists(), "{set} wrote something");
    }
}

#[test]
fn an_equilibrium_ignores_sections_of_a_motion_with_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let set = "chain=[{ name = \"c\", oscillators = 3, at = [0.0, 0.0] }]";
    let run = myovib_in(folder.path(), &["run", "cook-static", "--set", set]).with_code(0);
    let note = "not used by this analysis: [[chain]]";
    assert!(run.stderr.contains(note), "{}", run.stderr);
    myovib_in(folder.path(), &["check", "cook-static", "--set", set]).with_code(0);
}

#[test]
fn a_run_is_not_overwritten_by_accident() {
    let folder = tempfile::tempdir().unwrap();
    run_scene(folder.path(), "init", "out", &["time.end=0.02"]);
    let again = ["run", "init", "--out", "out", "--set", "time.end=0.02"];
    let again = myovib_in(folder.path(), &again).with_code(2);
    assert!(again.stderr.contains("--resume"), "{}", again.stderr);
}

/// Runs a scene once in one part and once in two parts. Returns the rows of the probe in both runs.
fn resumed(scene: &str, probe: &str, sets: &[&str], [part, end]: [&str; 2]) -> [Vec<Vec<f64>>; 2] {
    let folder = tempfile::tempdir().expect("a folder");
    let ending = |end: &str, out: &str, more: &[&str]| {
        let end = format!("time.end={end}");
        let mut words = vec!["run", scene, "--out", out, "--quiet", "--set", &end];
        words.extend(sets.iter().flat_map(|set| ["--set", set]));
        words.extend(more);
        myovib_in(folder.path(), &words).with_code(0);
        let document = read_json(&folder.path().join(out).join("run.json"));
        assert_eq!(document["outcome"], "finished");
        assert_eq!(document["resumed"], u64::from(!more.is_empty()));
        results::read_table(&folder.path().join(format!("{out}/{probe}.csv"))).1
    };
    let uninterrupted = ending(end, "whole", &[]);
    ending(part, "parts", &[]);
    [uninterrupted, ending(end, "parts", &["--resume"])]
}

/// Returns the largest difference in column `j`, relative to the maximum of this column.
fn difference([a, b]: &[Vec<Vec<f64>>; 2], j: usize) -> f64 {
    let times = |rows: &[Vec<f64>]| -> Vec<f64> { rows.iter().map(|row| row[0]).collect() };
    assert_eq!(times(a), times(b));
    let largest = a.iter().map(|row| row[j].abs()).fold(0.0, f64::max);
    let differences = a.iter().zip(b).map(|(a, b)| (a[j] - b[j]).abs());
    differences.fold(0.0, f64::max) / largest
}

#[test]
fn a_finished_run_has_nothing_to_go_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let common = ["run", "init", "--quiet", "--set", "time.end=0.02"];
    assert_eq!(myovib_in(folder.path(), &common).code, 0);
    let document = folder.path().join("out/run.json");
    let before = fs::read(&document).unwrap();
    let again = myovib_in(folder.path(), &[&common[..], &["--resume"]].concat()).with_code(2);
    for printed in ["finished", "out", "t = 0.02 s", "--overwrite"] {
        assert!(again.stderr.contains(printed), "{printed}: {}", again.stderr);
    }
    assert_eq!(fs::read(&document).unwrap(), before);
}

#[test]
fn a_run_with_radau_goes_on_from_its_checkpoint() {
    // The first part ends after the middle of the ramp.
    let rows = resumed("init", "origin", &["integrator.method=radau5"], ["0.8", "1.2"]);
    // The absolute tolerance is 2 % of the amplitude of u_y. A one-step method loses only the history of step sizes.
    assert!(difference(&rows, 2) < 0.02, "u_y {}", difference(&rows, 2));
    assert!(difference(&rows, 3) < 0.02, "p {}", difference(&rows, 3));
}

#[test]
fn a_run_with_two_way_coupling_goes_on_from_its_checkpoint() {
    // At this gain, the chains synchronize within a second, which changes the stiffness.
    let sets = ["chain[0].gain=2e6", "chain[1].gain=2e6", "chain[2].gain=2e6"];
    let rows = resumed("two-way", "feedback", &sets, ["0.5", "0.8"]);
    let factors = || rows[0].iter().map(|row| row[2]);
    assert!(factors().fold(f64::INFINITY, f64::min) < 1.4, "it acts");
    for chain in 1..=3 {
        let found = difference(&rows, chain);
        // The relative tolerance is 1e-4 for the chains, and 1e-3 for the muscle that drives them. The restart at order
        // 1 adds to the error, which is 1 % in total.
        assert!(found < 0.01, "chain {chain}: {found}");
    }
}

#[test]
fn a_pressure_acts_toward_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let origin = |out: &str, load: &str| {
        let document =
            run_scene(folder.path(), "init", out, &["traction=[]", "analysis=static", load]);
        document["results"]["origin"]["u_y"].as_f64().unwrap()
    };
    let pressed = origin("pressed", "pressure=[{ group = \"load\", value = 100.0 }]");
    let pushed = origin("pushed", "traction=[{ group = \"load\", y = -100.0 }]");
    // The muscle bends by 0.7 % of half of its length, and the slope of its loaded top is at most 0.17.
    assert!(pressed < 0.0 && (pressed / pushed - 1.0).abs() < 0.1);
    assert_ne!(pressed, pushed);
}

/// Checks that the damping determines the order of BDF, and that the reason is stated. With β = 1e-2 s, all modes above
/// ten times the drive frequency of 8 Hz are overdamped, so they are in the stability sector of every order. With β =
/// 1e-4 s, they are not.
#[test]
fn the_order_of_bdf_is_chosen_by_the_damping_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    for (beta, order) in [("1e-2", 5), ("1e-4", 2)] {
        let beta = format!("solid.rayleigh_stiffness={beta}");
        let automatic = "integrator.max_order=\"auto\"";
        let sets = ["integrator.method=bdf", automatic, "time.end=0.01", &beta];
        let document = run_scene(folder.path(), "init", &order.to_string(), &sets);
        assert_eq!(document["max_order"], order);
        let reason = document["max_order_reason"].as_str().unwrap();
        assert!(reason.starts_with(&format!("order {order}: ")), "{reason}");
        assert_eq!(document["scene"]["integrator"]["max_order"], "auto");
    }
    let rod = ["run", "figure3", "--set", "integrator.max_order=\"auto\""];
    let run = myovib_in(folder.path(), &rod).with_code(2);
    assert!(run.stderr.contains("max_order"), "{}", run.stderr);
}

#[test]
fn a_run_of_the_rod_starts_whatever_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let long = ["--set", "time.end=2000", "--set", "integrator.max_steps=300"];
    let out = ["--out", "long", "--quiet"];
    myovib_in(folder.path(), &[&["run", "figure3"][..], &out, &long].concat());
    let document = read_json(&folder.path().join("long/run.json"));
    assert_eq!(document["reason"], "max_steps", "{}", document["message"]);
}

/// Regression: a run that needed exactly the maximum number of steps was reported as stopped.
#[test]
fn as_many_steps_as_are_needed_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    let with = |most: u64, out: &str| {
        let most = format!("integrator.max_steps={most}");
        let words = ["run", "init", "--quiet", "--set", "time.end=0.2"];
        let words = [&words[..], &["--set", &most, "--out", out]].concat();
        let code = myovib_in(folder.path(), &words).code;
        (code, read_json(&folder.path().join(out).join("run.json")))
    };
    let (_, whole) = with(1000, "whole");
    let steps = whole["steps"].as_u64().unwrap();
    let (code, enough) = with(steps, "enough");
    assert_eq!((code, &enough["outcome"]), (0, &whole["outcome"]));
    let (code, short) = with(steps - 1, "short");
    assert_eq!((code, &short["reason"]), (3, &"max_steps".into()));
}

#[test]
fn unrequested_quantities_are_not_computed() {
    let folder = tempfile::tempdir().unwrap();
    let end = ["time.end=0.2"];
    let undamped = run_scene(folder.path(), "table2-1", "undamped", &end);
    assert_eq!(undamped["work"]["force_rate_passes"], 0);
    assert_eq!(undamped["work"]["rate_tangent_passes"], 0);
    assert_eq!(undamped["indices"]["p_rate"], Value::Null, "β = 0: no μ");
    assert_eq!(undamped["output_work"]["field_files"], 0);
    assert_eq!(undamped["output_work"]["stress_evaluations"], 0);
    assert_eq!(undamped["output_work"]["energy_evaluations"], 0);
    assert_eq!(undamped["unknowns"], 2849, "no chain, no chain states");

    let damped = run_scene(folder.path(), "init", "damped", &end);
    assert_eq!(damped["work"]["force_rate_passes"], damped["work"]["residual_passes"]);
    assert!(damped["output_work"]["stress_evaluations"].as_u64() > Some(0));

    let linear = run_scene(folder.path(), "table1-26-finite-undamped", "linear", &end);
    assert_eq!(linear["work"]["tangent_passes"], 1, "linear: one assembly");
    assert!(linear["jacobian_evaluations"].as_u64() > Some(1));

    let rod = run_scene(folder.path(), "figure3", "rod", &end);
    assert_eq!(rod["mesh"], Value::Null, "a rod reads no mesh");
    assert_eq!((&rod["unknowns"], &rod["work"]["residual_passes"]), (&60.into(), &0.into()));
}

//! Tests of `--integrator radau5` and `integrator.method = "radau5"`: error tests, messages and rejected options.

use std::fs;

use myovib_scene::builtin;
use serde_json::{Value, json};

use crate::harness::{myovib, myovib_in};
use crate::results::{read_json, read_table, run_scene};
use crate::table2::short_table;

#[test]
fn radau_reports_that_it_tests_all_variables() {
    let table = short_table(&["--integrator", "radau5"]);
    let rows = table["rows"].as_array().unwrap();
    let keys: Vec<_> = rows.iter().map(|row| row["key"].clone()).collect();
    assert_eq!(keys, ["1", "2", "3", "4", "31"]);
    for row in rows {
        let key = &row["key"];
        assert_eq!(row["outcome"], "finished", "row {key}");
        assert_eq!(row["suppressed"], json!([]));
        assert_eq!(row["conventions"], json!([]));
        let settings = [&row["integrator"], &row["stages"], &row["order"]];
        assert_eq!(settings, [&Value::from("radau5"), &3.into(), &5.into()]);
        let fields = row.as_object().unwrap();
        for of_bdf in ["max_order", "delta_cj", "multiplier_weights", "projection_interval"] {
            assert!(!fields.contains_key(of_bdf), "row {key}: {of_bdf}");
        }
        // A setup needs one real and one complex factorization, and an iteration needs one solve with each of them.
        let work = &row["radau_work"];
        assert_eq!(work["real_factorizations"], row["linear_setups"]);
        assert_eq!(work["complex_factorizations"], row["linear_setups"]);
        assert_eq!(work["complex_solves"], row["newton_iterations"]);
    }
    assert_eq!(table["modified"], true);
}

#[test]
fn radau_excludes_the_requested_variables() {
    let arguments = ["--integrator", "radau9", "--rows", "4", "--suppress"];
    let table = short_table(&[&arguments[..], &["lambda"]].concat());
    let row = &table["rows"][0];
    assert_eq!(row["suppressed"], json!(["lambda"]));
    assert_eq!(row["last_order"], 9);
}

/// Checks that the absolute tolerances of Radau IIA follow the relative tolerance unless they are given. A smaller
/// relative tolerance alone would loosen the absolute tolerances that the method uses internally.
#[test]
fn absolute_tolerances_follow_the_relative_one_unless_given() {
    let tolerances = |arguments: &[&str]| {
        let table = short_table(&[&["--rows", "1", "--rtol", "1e-5"], arguments].concat());
        let atol = &table["rows"][0]["atol"];
        ["q", "v", "lambda"].map(|block| atol[block].as_f64().unwrap())
    };
    let expect = |found: [f64; 3], expected: [f64; 3]| {
        for (found, expected) in found.into_iter().zip(expected) {
            // The scaling factor contains a rounding error.
            let error = (found - expected).abs();
            assert!(error <= 2.0 * f64::EPSILON * expected, "{found} {expected}");
        }
    };
    let radau = ["--integrator", "radau5"];
    expect(tolerances(&radau), [1e-7, 1e-7, 1e-3]);
    let given = [&radau[..], &["--atol-velocity", "1e-6"]].concat();
    expect(tolerances(&given), [1e-7, 1e-6, 1e-3]);
    // With BDF, the rows have the paper's values except for the requested changes.
    expect(tolerances(&[]), [1e-5, 1e-5, 1e-1]);

    let folder = tempfile::tempdir().unwrap();
    let paper = builtin::find("table2-1").unwrap().text;
    let tight = |line: &&str| !line.starts_with("atol") && !line.starts_with("rtol");
    let lines: Vec<_> = paper.lines().filter(tight).collect();
    let scene = lines.join("\n").replace("[integrator]", "[integrator]\natol.v = 1e-6\n#");
    fs::write(folder.path().join("tight.toml"), scene).unwrap();
    let of_scene = |rtol: &str| {
        let set = format!("integrator.rtol={rtol}");
        let more = ["--overwrite", "--set", &set, "--set", "time.end=0.02"];
        myovib_in(folder.path(), &[&["run", "tight.toml", "--quiet"], &more[..]].concat())
            .with_code(0);
        let atol = &read_json(&folder.path().join("out/run.json"))["atol"];
        ["u", "v", "p"].map(|block| atol[block].as_f64().unwrap())
    };
    let [loose, tight] = ["1e-5", "1e-6"].map(of_scene);
    assert_eq!([loose[1], tight[1]], [1e-6; 2]);
    for block in [0, 2] {
        // The tolerance covers a few rounding errors.
        assert!((loose[block] / tight[block] - 10.0).abs() < 1e-13);
    }
}

#[test]
fn settings_of_bdf_are_rejected_with_radau() {
    for (arguments, option) in [
        (["--max-order", "2"], "--max-order"),
        (
            ["--set", "integrator.multiplier_weights=step-scaled"],
            "--set integrator.multiplier_weights=step-scaled",
        ),
        (
            ["--set", "integrator.projection_interval=0.1"],
            "--set integrator.projection_interval=0.1",
        ),
        (["--rows", "2m"], "--rows"),
    ] {
        let run = myovib(&[&["table2", "--integrator", "radau5"][..], &arguments].concat());
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(run.stderr.contains(&format!("where: {option}")), "{}", run.stderr);
    }
}

#[test]
fn a_scene_with_radau_tests_all_variables_by_default() {
    let folder = tempfile::tempdir().unwrap();
    let run = |out: &str, more: &[&str]| {
        let sets = [&["time.end=0.02", "integrator.method=radau9"], more].concat();
        run_scene(folder.path(), "table2-1", out, &sets)
    };
    let document = run("all", &[]);
    assert_eq!(document["suppressed"], json!([]));
    assert_eq!([&document["stages"], &document["order"]], [5, 9]);
    assert_eq!(document.get("delta_cj"), None);
    assert_eq!(document.get("max_order"), None);
    let work = &document["radau_work"];
    assert_eq!(work["real_factorizations"], document["linear_setups"]);
    let document = run("motion", &["integrator.error_test.exclude=[\"p\"]"]);
    assert_eq!(document["suppressed"], json!(["p"]));
}

#[test]
fn keys_of_bdf_are_rejected_with_radau_and_their_location() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |line: &str| {
        let text = myovib(&["init", "-"]).stdout;
        let text = text.replacen("rtol = 1e-4", &format!("rtol = 1e-4\n{line}\n#"), 1);
        fs::write(folder.path().join("scene.toml"), text).unwrap();
        myovib_in(folder.path(), &["run", "scene.toml"])
    };
    for (line, key) in [
        ("max_order = 2", "max_order"),
        ("multiplier_weights = \"step-scaled\"", "multiplier_weights"),
        ("projection_interval = 0.1", "projection_interval"),
    ] {
        let run = scene(line);
        assert_eq!(run.code, 2, "{line}: {}", run.stderr);
        for part in ["scene.toml, line 41", &format!("no `{key}`")] {
            assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
        }
        assert!(!folder.path().join("out").exists());
    }
}

/// Checks that two-way coupling with both integrators results in the same stiffness factors.
#[test]
fn radau_integrates_a_muscle_with_feedback() {
    let folder = tempfile::tempdir().unwrap();
    let atol = "rtol = 1e-3\natol = { u = 1e-5, v = 1e-5, p = 0.1, p_rate = 5.0 }";
    let order = &format!("method = \"bdf\"\n{atol}\nmax_order = 3");
    let text = builtin::find("two-way").unwrap().text;
    assert!(text.contains(order), "the scene is for BDF");
    // At this gain, the chains synchronize, which changes the stiffness.
    let text = text.replace("gain = ", "gain = 2e6 # ");
    let factors = |name: &str, line: &str| -> Vec<f64> {
        let file = format!("{name}.toml");
        fs::write(folder.path().join(&file), text.replace(order, line)).unwrap();
        run_scene(folder.path(), &file, name, &["time.end=0.8"]);
        let (_, rows) = read_table(&folder.path().join(name).join("feedback.csv"));
        rows.iter().flat_map(|row| &row[1..]).copied().collect()
    };
    let (bdf, radau) =
        (factors("bdf", order), factors("radau5", &format!("method = \"radau5\"\n{atol}")));
    assert!(bdf.iter().copied().fold(f64::INFINITY, f64::min) < 1.4, "it acts");
    let apart = bdf.iter().zip(&radau).map(|(a, b)| (a - b).abs());
    // At the paper's tolerances, the motion of the muscle that drives the chains has an error of several percent.
    assert!(apart.fold(0.0, f64::max) < 0.05);
}

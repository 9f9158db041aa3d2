//! What `myovib-bench` says about the solver, as far as it does not depend on the clock.

#[path = "../../../tests/acceptance/harness.rs"]
mod harness;

use std::fs;

use serde_json::Value;

use harness::{code_of_interrupted, document, myovib, myovib_in};

fn bench(arguments: &[&str]) -> Value {
    let run = myovib(arguments);
    assert_eq!(run.code, 0, "{}", run.stderr);
    document(&run.stdout, "bench")
}

/// The condensed solver is the full one but for rounding: steps differ by 2 % at most, which is
/// what a change of the last bits does to step-size control.
#[test]
fn all_linear_solvers_make_the_same_steps() {
    let document = bench(&["bench", "rows", "--t-end", "0.6", "--quiet", "--json"]);
    let runs = document["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 12, "four rows by three solvers");
    for run in runs {
        assert_eq!(run["outcome"], "finished");
        assert!(run["more_steps"].as_f64().unwrap().abs() <= 0.02, "{run}");
        let work = &run["linear_work"];
        if run["linear_solver"] == "condensed" {
            assert_eq!(work["factorizations"], run["linear_setups"]);
            assert!(work["solves"].as_u64() >= run["steps"].as_u64(), "{run}");
            // Solutions above it would have been refined.
            assert!(
                work["largest_backward_error"].as_f64().unwrap() < 1e-12,
                "{run}"
            );
        } else {
            assert!(work.is_null());
        }
    }
}

/// What a scene does not have is not computed: no pass over the elements asks for it.
#[test]
fn what_is_off_is_never_computed() {
    let document = bench(&["bench", "features", "--t-end", "0.5", "--quiet", "--json"]);
    let rows = document["features"].as_array().unwrap();
    let count = |row: &Value, name: &str| row[name].as_u64().unwrap();
    for row in rows {
        let is_damped = row["feature"].as_str().unwrap().contains('β');
        let passes = count(row, "residual_passes");
        assert_eq!(
            count(row, "force_rate_passes"),
            if is_damped { passes } else { 0 },
            "{row}"
        );
        let tangents = count(row, "tangent_passes");
        let damped_tangents = if is_damped { tangents } else { 0 };
        assert_eq!(count(row, "rate_tangent_passes"), damped_tangents, "{row}");
    }
    // A linear law has constant matrices.
    assert!(
        rows.iter()
            .take(3)
            .all(|row| count(row, "tangent_passes") == 1)
    );
}

#[test]
fn options_that_a_measurement_does_not_have_are_refused() {
    for (arguments, option) in [
        (&["rows", "--svg", "x.svg"][..], "--svg"),
        (&["growth", "--cases", "undamped"], "--cases"),
        (&["accuracy", "--rival", "x.json"], "--rival"),
        (&["work", "--t-end", "1e-9"], "--t-end"),
        (&["rows", "--t-end", "-1"], "--t-end"),
        (&["work", "--tolerances", "1e-3,0"], "--tolerances"),
        (&["features", "--repeats", "0"], "--repeats"),
        (&["work", "--cap", "nan"], "--cap"),
    ] {
        let run = myovib(&[&["bench"][..], arguments].concat());
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(run.stderr.contains(option), "{}", run.stderr);
    }
}

/// A small diagram: every point is a row, orders are stated, the points of a rival are merged, and
/// the picture is drawn.
#[test]
fn work_and_precision_end_to_end() {
    let folder = tempfile::tempdir().unwrap();
    let rival = r#"[{"case":"undamped","formulation":"position","way":"other","rtol":1e-3,
        "stopped":null,"u_y":0.02,"p":0.01,"cpu_seconds":1.5,"steps":100,
        "residual_evaluations":300,"linear_setups":20}]"#;
    fs::write(folder.path().join("rival.json"), rival).unwrap();
    let run = myovib_in(
        folder.path(),
        &[
            "bench",
            "work",
            "--cases",
            "undamped",
            "--tolerances",
            "1e-2,1e-4",
            "--t-end",
            "0.3",
            "--cap",
            "20",
            "--rival",
            "rival.json",
            "--svg",
            "work.svg",
            "--quiet",
            "--json",
        ],
    );
    assert_eq!(run.code, 0, "{}", run.stderr);
    let document = document(&run.stdout, "bench");
    let points = document["points"].as_array().unwrap();
    assert_eq!(points.len(), 2 * 6 * 2, "formulations, ways, tolerances");
    for pair in points.chunks(2) {
        assert!(pair[0]["observed_order"].is_null(), "{pair:?}");
        assert_eq!(
            pair[1]["observed_order"].is_number(),
            pair.iter().all(|point| point["errors"].is_object()),
            "{pair:?}"
        );
        let error = |point: &serde_json::Value| point["errors"]["u_y"].as_f64().unwrap();
        assert!(error(&pair[1]) < error(&pair[0]), "{pair:?}");
    }
    assert_eq!(document["rival"][0]["way"], "other");
    let svg = fs::read_to_string(folder.path().join("work.svg")).unwrap();
    assert!(svg.contains("other") && svg.contains("velocity"));
    assert!(!document["best"].as_array().unwrap().is_empty());
}

#[test]
fn an_interrupted_bench_is_code_130_and_gives_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "bench",
        "rows",
        "--repeats",
        "1000",
        "--quiet",
        "--json",
        "rows.json",
    ];
    assert_eq!(code_of_interrupted(folder.path(), &arguments), Some(130));
    let text = fs::read_to_string(folder.path().join("rows.json")).unwrap();
    let runs = &document(&text, "bench")["runs"];
    assert_eq!(runs[0]["row"], "1");
    assert!(runs[0]["cpu_seconds"].as_f64().unwrap() > 0.0, "{runs}");
}

/// Before it computes: hours would be lost.
#[test]
fn every_command_sees_at_once_that_its_document_cannot_be_written() {
    let folder = tempfile::tempdir().expect("a folder");
    for command in ["bench", "stress"] {
        for target in ["no/such.json", "."] {
            let run = myovib_in(folder.path(), &[command, "--json", target]);
            assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{command}");
            let message = format!("invalid value '{target}' for '--json");
            assert!(run.stderr.contains(&message), "{command}: {}", run.stderr);
        }
    }
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
}

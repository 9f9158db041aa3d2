//! Tests of large bodies: their cost is predicted before the run, and results do not depend on the number of threads.

#![allow(clippy::unwrap_used)] // Helpers outside #[test] functions also fail the test.

use std::fs;

use serde_json::Value;

use crate::harness::myovib_in;

/// Results of the 3D spindle (19 000 unknowns) after at most two steps.
struct Left {
    code: i32,
    document: Value,
    state: String,
    printed: String,
}

fn spindle(command: &str, more: &[&str]) -> Left {
    left(command, "muscle3d", more)
}

fn left(command: &str, scene: &str, more: &[&str]) -> Left {
    let folder = tempfile::tempdir().unwrap();
    let start = [command, scene, "--quiet", "--json=d.json"];
    let steps = ["--set", "integrator.max_steps=2"];
    let run = myovib_in(folder.path(), &[&start[..], &steps, more].concat());
    let text = |name| fs::read_to_string(folder.path().join(name)).unwrap_or("null".into());
    Left {
        code: run.code,
        document: serde_json::from_str(&text("d.json")).unwrap(),
        state: text("out/state.json"),
        printed: run.stderr,
    }
}

#[test]
fn a_body_that_does_not_fit_is_refused_before_it_is_factorized() {
    let left = spindle("run", &["--memory", "150MiB"]);
    assert_eq!(left.code, 4, "{}", left.printed);
    assert!(left.document.is_null());
    for words in ["the factors need ", "MiB of memory", "coarser mesh", "BDF"] {
        assert!(left.printed.contains(words), "{words}: {}", left.printed);
    }
}

/// Returns the ratio of the memory that `check` predicts to the memory that the run uses, and the results of the run.
fn predicted_memory(scene: &str, threads: &str) -> (f64, Left) {
    let check = left("check", scene, &["--threads", threads]);
    let factors = &check.document["body"]["factors"];
    let number = |key: &str| factors[key].as_f64().unwrap_or_else(|| panic!("{}", check.printed));
    let predicted = number("bytes") + number("bytes_before");
    let run = left("run", scene, &["--threads", threads]);
    let peak = run.document["peak_memory_bytes"].as_f64();
    let peak = peak.unwrap_or_else(|| panic!("{}", run.printed));
    (predicted / peak, run)
}

#[test]
fn the_peak_of_memory_is_predicted_and_threads_change_no_bit() {
    let states = ["1", "2"].map(|threads| {
        let (ratio, run) = predicted_memory("muscle3d", threads);
        // The documented accuracy for large bodies is 20 %.
        assert!((ratio - 1.0).abs() < 0.2, "{threads} threads: {ratio}");
        run.state
    });
    assert_ne!(states[0], "null");
    assert_eq!(states[0], states[1]);
}

/// Checks a body whose matrix setup takes 10¹¹ operations. For such a body, `check` does not factorize.
#[test]
#[ignore = "slow"]
fn a_check_of_a_large_body_predicts_and_tries_nothing() {
    let check = left("check", "ventricle", &["--threads", "1"]);
    let body = &check.document["body"];
    assert_eq!(body["cost"]["end"], "predicted", "{}", check.printed);
    assert_eq!(body["slow_modes"].as_array().map(Vec::len), Some(0));
    // One machine took 1351 s for 167 steps.
    assert!(body["cost"]["seconds_per_step"].as_f64() > Some(0.1), "{body}");
    let (ratio, _) = predicted_memory("ventricle", "1");
    assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
}

//! Tests of the results of `myovib-bench` that do not depend on timing.

#[path = "../../../tests/acceptance/harness.rs"]
mod harness;

use std::fs;

use serde_json::Value;

use harness::{code_of_interrupted, document, myovib, myovib_in};

fn bench(arguments: &[&str]) -> Value {
    document(&myovib(arguments).with_code(0).stdout, "bench")
}

/// Checks that the condensed and the full solver agree up to rounding errors. As rounding errors affect the step size
/// control, step counts may differ by up to 2 %.
#[test]
fn all_linear_solvers_take_similar_steps() {
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
            // A solution is refined if its backward error exceeds this bound.
            assert!(work["largest_backward_error"].as_f64().unwrap() < 1e-12, "{run}");
        } else {
            assert!(work.is_null());
        }
    }
}

#[test]
fn options_of_other_measurements_are_rejected() {
    for (arguments, option) in [
        (&["large", "--t-end", "1"][..], "--t-end"),
        (&["rows", "--cases", "growth"], "--cases"),
        (&["rows", "--t-end", "-1"], "--t-end"),
        (&["rows", "--repeats", "0"], "--repeats"),
    ] {
        let run = myovib(&[&["bench"][..], arguments].concat());
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(run.stderr.contains(option), "{}", run.stderr);
    }
}

#[test]
fn an_interrupted_bench_exits_with_130_and_prints_its_results() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["bench", "rows", "--repeats", "1000", "--quiet", "--json=rows.json"];
    assert_eq!(code_of_interrupted(folder.path(), &arguments), Some(130));
    let text = fs::read_to_string(folder.path().join("rows.json")).unwrap();
    let runs = &document(&text, "bench")["runs"];
    assert_eq!(runs[0]["row"], "1");
    assert!(runs[0]["cpu_seconds"].as_f64().unwrap() > 0.0, "{runs}");
}

/// Checks that an output path is validated before the measurement starts, because a measurement may take hours.
#[test]
fn an_output_that_cannot_be_written_is_rejected_first() {
    let folder = tempfile::tempdir().expect("a folder");
    for target in ["no/such.json", "."] {
        let json = format!("--json={target}");
        let run = myovib_in(folder.path(), &["bench", &json]);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""));
        assert!(run.stderr.contains("--json"), "{}", run.stderr);
    }
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
}

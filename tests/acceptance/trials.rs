//! Tests of `check`, which computes the first steps of a run. Its predictions are compared with the run.

#![allow(clippy::unwrap_used)] // Helpers outside #[test] functions also fail the test.

use serde_json::Value;

use crate::harness::{document, myovib, myovib_in};

/// Returns the cost that `check` predicts, and the document of the run.
fn predicted_and_run(scene: &str, sets: &[&str]) -> (Value, Value) {
    let folder = tempfile::tempdir().unwrap();
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let of = |command: &str| {
        let words = [&[command, scene, "--quiet", "--json"][..], &sets].concat();
        let printed = myovib_in(folder.path(), &words);
        document(&printed.stdout, command)
    };
    (of("check")["body"]["cost"].clone(), of("run"))
}

fn steps(of: &Value) -> u64 {
    of["steps"].as_u64().unwrap_or_else(|| panic!("{of}"))
}

/// Checks that `check` computes a short run completely, for a body with each method, a body with chains, a contracting
/// body, and a body with two-way coupled chains.
#[test]
fn the_cost_counts_all_steps_of_a_short_run() {
    let chain = "chain=[{ name = \"here\", at = [0.0, 0.0], oscillators = 2 }]";
    let fibers = "material[0].fiber=[1.0, 0.0]";
    let tension = "material[0].active={ type = \"given\", tension = { type = \"step\", value = 1e4, rise = 0.2 } }";
    let cases: [(&str, &[&str]); 6] = [
        ("init", &["time.end=0.5"]),
        ("init", &["time.end=0.5", chain]),
        ("init", &["time.end=0.3", fibers, tension]),
        ("cook-dynamic", &["time.end=5.0"]),
        ("two-way", &["time.end=0.1"]),
        // The run ends at the step limit of the scene.
        ("cook-dynamic", &["integrator.max_steps=20"]),
    ];
    for (scene, sets) in cases {
        let (reported, run) = predicted_and_run(scene, sets);
        assert_eq!(reported["end"], "finished", "{scene} {sets:?}: {reported}");
        assert_eq!(steps(&reported), steps(&run), "{scene} {sets:?}");
        assert_eq!(reported["t"], run["t_reached"], "{scene} {sets:?}");
    }
}

/// Checks that `check` gives a lower bound for a longer run, both for a small vibration and for a vibration that has
/// not started yet.
#[test]
fn the_predicted_steps_are_a_lower_bound() {
    for (scene, sets) in [("hardening", ["time.end=1.5"]), ("two-way", ["time.end=4.0"])] {
        let (reported, run) = predicted_and_run(scene, &sets);
        let all = reported["end"] == "finished";
        assert!(all || reported["end"] == "patience", "{scene}: {reported}");
        assert_eq!(steps(&reported) == steps(&run), all, "{scene}: {reported}");
        assert!(steps(&reported) <= steps(&run), "{scene}: {reported}");
        assert!(steps(&reported) > 10, "{scene}: {reported}");
    }
}

/// Checks that `check` ignores stop conditions and reports this.
#[test]
fn stop_conditions_do_not_bound_the_cost() {
    let stop = "stop=[{ type = \"displacement\", at = [0.0, 0.0], above = 1.0 }]";
    let text = myovib(&["check", "init", "--set", stop, "--set", "time.end=0.1"]).stdout;
    assert!(text.contains("[[stop]]"), "{text}");
}

/// Checks that `check` predicts that a run stops before its end time.
#[test]
fn a_stop_of_the_run_is_predicted() {
    // Elements are inverted under this load.
    let load = "traction[0].y={ type = \"step\", value = -2e4, rise = 0.2 }";
    let (reported, run) = predicted_and_run("table2-4", &[load]);
    assert_eq!(reported["end"], "stopped", "{reported}");
    assert_eq!(steps(&reported), steps(&run));
    assert_eq!(reported["t"], run["t_reached"]);
    let text = myovib(&["check", "table2-4", "--set", load]).stdout;
    let words = format!("cost            a trial run stops: {}", run["message"].as_str().unwrap());
    assert!(text.contains(&words), "{words}: {text}");
}

/// Checks a sweep that passes modes at 5.13, 12.43 and 15.69 Hz.
#[test]
fn check_reports_the_modes_that_a_chirp_passes() {
    let passed = |from: f64, to: f64, duration: f64| {
        let load = format!(
            "traction[0].y={{ type = \"chirp\", amplitude = 10.0, frequency = {from:?}, \
             end_frequency = {to:?}, duration = {duration:?} }}"
        );
        let text = myovib(&["check", "init", "--set", &load, "--set", "time.end=0.1"]).stdout;
        let line = text.lines().find(|line| line.starts_with("sweep "));
        line.unwrap_or_else(|| panic!("{text}")).to_owned()
    };
    for (from, to, duration, words) in [
        (14.0, 4.0, 0.1, "from 4 to 14 Hz passes the modes at 5.13, 12.43 Hz"),
        // The run ends before the frequency sweep does.
        (4.0, 14.0, 0.2, "from 4 to 9 Hz passes the modes at 5.13 Hz"),
        (4.0, 20.0, 0.1, "at 5.13, 12.43, 15.69 Hz, and perhaps higher ones"),
        (1.0, 5.0, 0.1, "passes no mode"),
        (20.0, 30.0, 0.1, "may pass modes above 15.69 Hz"),
    ] {
        let line = passed(from, to, duration);
        assert!(line.ends_with(words), "{line}");
    }
    assert!(!myovib(&["check", "init"]).stdout.contains("sweep "));
}

//! Tests of runs that are killed at each system call that changes a file, and then resumed. The tests require strace;
//! without it, nothing is tested.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // Helpers outside #[test] functions also fail the test.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::harness::{PROGRAM, myovib_in};
use crate::results::{parse_table, read_json};
use crate::writes::SCENE;

/// System calls that change files.
const CALLS: [&str; 4] = ["write", "fsync", "renameat", "unlinkat"];

/// Keys whose values vary between runs: times, memory, the number of resumes, and the checksum of checkpoints, which
/// contain this number.
const VARIABLE: [&str; 6] = [
    "cpu_seconds",
    "wall_seconds",
    "wall_seconds_by_part",
    "peak_memory_bytes",
    "resumed",
    "sha256",
];

/// Runs the program under strace. Returns the calls and whether the program was killed, or `None` if strace is not
/// installed.
fn trace(folder: &Path, options: &[&str], arguments: &[&str]) -> Option<(String, bool)> {
    let traced = Command::new("strace")
        .args(["-f", "-qq", "-o", "calls"])
        .args(options)
        .arg(PROGRAM)
        .args(arguments)
        .current_dir(folder)
        .output();
    // strace ends with the same signal as the program.
    let was_killed = traced.ok()?.status.signal() == Some(9);
    Some((fs::read_to_string(folder.join("calls")).ok()?, was_killed))
}

/// Returns the largest number of these calls in any thread. strace counts the calls of each thread separately.
fn most_of_a_thread(calls: &str, call: &str) -> usize {
    let mut counts = BTreeMap::new();
    for line in calls.lines().filter(|line| line.contains(&format!(" {call}("))) {
        *counts.entry(line.split(' ').next()).or_insert(0) += 1;
    }
    counts.into_values().max().unwrap_or(0)
}

fn remove_variable(document: &mut Value) {
    match document {
        Value::Object(all) => {
            all.retain(|key, _| !VARIABLE.contains(&key.as_str()));
            all.values_mut().for_each(remove_variable);
        }
        Value::Array(all) => all.iter_mut().for_each(remove_variable),
        _ => {}
    }
}

/// Returns the files in a folder without the values that vary between runs.
fn files(folder: &Path) -> BTreeMap<String, String> {
    let comparable = |name: &str, text: &str| {
        if name.ends_with(".json") {
            let mut document = serde_json::from_str(text).unwrap();
            remove_variable(&mut document);
            return document.to_string();
        }
        let row = |key: &str| format!("<tr><td>{key}</td>");
        let is_constant = |line: &&str| {
            let is_time = line.ends_with("<span>CPU time</span></div>\n");
            !is_time && !VARIABLE.iter().any(|key| line.starts_with(&row(key)))
        };
        text.split_inclusive('\n').filter(is_constant).collect()
    };
    let file = |entry: fs::DirEntry| {
        let name = entry.file_name().into_string().unwrap();
        let text = fs::read_to_string(entry.path()).unwrap();
        (name.clone(), comparable(&name, &text))
    };
    fs::read_dir(folder).unwrap().map(|entry| file(entry.unwrap())).collect()
}

/// Checks that each column of the two tables differs by at most the error that `--verify` measured.
fn assert_within_error(found: &str, expected: &str, errors: &Value) {
    let ((names, found), (_, expected)) = (parse_table(found), parse_table(expected));
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(&expected) {
        assert_eq!(a[0], b[0]);
        for j in 1..names.len() {
            let error = errors[&names[j]]["error"].as_f64().unwrap();
            assert!((a[j] - b[j]).abs() <= error, "{} at {}: {} {}", names[j], a[0], a[j], b[j]);
        }
    }
}

/// Kills a run at every `stride`-th of its calls and resumes it. The files must be equal to the files of an
/// uninterrupted run. Because BDF cannot continue with its history, its tables may differ by less than the time
/// integration error. Returns the number of killed runs and the number of runs whose files differ.
fn assert_killed_runs_are_completed(method: &str, verify: bool, stride: usize) -> [usize; 2] {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = SCENE.replace("radau5", method)
        + "[checkpoint]\ninterval = 0.008\n[fields]\ninterval = 0.01\n";
    fs::write(folder.join("scene.toml"), scene).unwrap();
    let common = ["run", "scene.toml", "--quiet", "--threads", "1"];
    let run = [&common[..], if verify { &["--verify"] } else { &[] }].concat();
    let resume = [&run[..], &["--resume"]].concat();
    let traced = trace(folder, &["-e", &format!("trace={}", CALLS.join(","))], &run);
    let Some((calls, _)) = traced else {
        eprintln!("skipped: strace is not installed");
        return [0; 2];
    };
    let measured = [&common[..], &["--verify", "--out", "measured"]].concat();
    assert_eq!(myovib_in(folder, &measured).code, 0);
    let measured = read_json(&folder.join("measured/run.json"));
    let expected = files(&folder.join("out"));
    let [mut runs, mut different] = [0; 2];
    for call in CALLS {
        let count = most_of_a_thread(&calls, call);
        assert!(count > 0 || call == "unlinkat", "{calls}");
        for n in (1..=count).step_by(stride) {
            fs::remove_dir_all(folder.join("out")).unwrap();
            let kill = format!("inject={call}:signal=KILL:when={n}");
            let traced = trace(folder, &["-e", &format!("trace={call}"), "-e", &kill], &run);
            let (_, was_killed) = traced.expect("strace has run before");
            assert!(was_killed, "{call} {n} of {count}: the run ended before its kill");
            let resumed = myovib_in(folder, &resume);
            let found = files(&folder.join("out"));
            // The run was killed after it had finished, but before it reported to standard output.
            let was_finished = resumed.code == 2 && found == expected;
            assert!(resumed.code == 0 || was_finished, "{call} {n}: {}", resumed.stderr);
            assert!(found.keys().eq(expected.keys()), "{call} {n}: {:?}", found.keys());
            if found != expected {
                let errors = &measured["error_estimate"]["probes"]["tip"];
                assert_within_error(&found["tip.csv"], &expected["tip.csv"], errors);
                assert_eq!(method, "bdf", "{call} {n}");
                different += 1;
            }
            runs += 1;
        }
    }
    [runs, different]
}

#[test]
fn runs_killed_at_some_changes_of_files_are_completed() {
    assert_killed_runs_are_completed("radau5", true, 12);
}

#[test]
#[ignore = "slow"]
fn runs_killed_at_any_change_of_a_file_are_completed() {
    for method in ["radau5", "bdf"] {
        for verify in [false, true] {
            let [runs, different] = assert_killed_runs_are_completed(method, verify, 1);
            eprintln!("{method}, verify: {verify}: {runs} runs, {different} with other files");
        }
    }
}

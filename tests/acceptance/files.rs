//! Tests of files that cannot be opened or that disappear during a run. The error names the file, and the exit code
//! shows whether output was written.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::harness::PROGRAM;

/// Writes the first built-in scene with `probes` additional probes.
fn write_scene(folder: &Path, probes: usize) {
    let probe = |i| format!("\n[[probe]]\nname = \"p{i}\"\ntype = \"energy\"\n");
    let probes: String = (1..probes).map(probe).collect();
    let scene = include_str!("../../data/scenes/init.toml").to_owned() + "\n" + &probes;
    fs::write(folder.join("scene.toml"), scene).expect("the scene");
}

/// Runs the scene after the shell command `setting`.
fn run_after(folder: &Path, setting: &str) -> (Option<i32>, String) {
    let run = "exec \"$0\" run scene.toml --quiet --set time.end=0.01 --set fields=";
    let Output { status, stderr, .. } = Command::new("bash")
        .args(["-c", &format!("{setting}; {run}"), PROGRAM])
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .expect("a shell");
    (status.code(), String::from_utf8_lossy(&stderr).into_owned())
}

#[test]
fn more_probes_than_the_system_lets_files_be_open_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), 60);
    let (code, stderr) = run_after(folder.path(), "ulimit -n 40");
    assert_eq!(code, Some(2), "{stderr}");
    for printed in ["60 probes", "40 files", "ulimit -n 76", "scene.toml"] {
        assert!(stderr.contains(printed), "{printed}: {stderr}");
    }
    assert!(!folder.path().join("out").exists());
    let (code, stderr) = run_after(folder.path(), "ulimit -n 76");
    assert_eq!(code, Some(0), "the advice holds: {stderr}");
}

/// Checks a limit that cannot be checked in advance, because files that other libraries open also count.
#[test]
fn too_many_open_files_are_code_4_and_the_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), 30);
    let held = "ulimit -n 64; for i in {10..49}; do eval \"exec $i</dev/null\"; done";
    let (code, stderr) = run_after(folder.path(), held);
    assert_eq!(code, Some(4), "{stderr}");
    assert!(stderr.contains("`out/p"), "{stderr}");
    assert!(stderr.contains("Too many open files"), "{stderr}");
}

/// Checks parallel cases that share the system's limit on open files: fewer cases run at a time, and all of them
/// succeed.
#[test]
fn cases_of_a_sweep_wait_for_each_other_where_few_files_may_be_open() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), 40);
    let sweep = "ulimit -n 80; exec \"$0\" sweep scene.toml --quiet --threads 4 --set time.end=0.1 \
                 --set fields= --vary solid.rayleigh_stiffness=1e-4..2e-4:8";
    let Output { stdout, stderr, .. } = Command::new("bash")
        .args(["-c", sweep, PROGRAM])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let [table, stderr] = [stdout, stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    let finished = table.lines().filter(|line| line.contains(",finished,")).count();
    assert_eq!(finished, 8, "{table}{stderr}");
}

#[test]
fn a_table_that_is_removed_while_the_run_goes_on_is_code_4_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Command::new(PROGRAM)
        .args(["run", "init", "--quiet", "--set", "fields="])
        .args(["--set", "time.end=1000", "--set", "checkpoint.interval=0.05"])
        .current_dir(folder.path())
        .env("NO_COLOR", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let csv = folder.path().join("out/origin.csv");
    let since = Instant::now();
    while !fs::read_to_string(&csv).is_ok_and(|text| text.lines().count() > 2) {
        assert!(since.elapsed() < Duration::from_secs(60), "it starts");
        std::thread::yield_now();
    }
    fs::remove_file(&csv).unwrap();
    // Without a limit, the run would take an hour.
    while run.try_wait().unwrap().is_none() && since.elapsed() < Duration::from_secs(120) {
        std::thread::yield_now();
    }
    let ended = run.try_wait().unwrap().is_some();
    run.kill().unwrap();
    let end = run.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&end.stderr);
    assert!(ended, "it sees at the next checkpoint that its table has gone");
    assert_eq!(end.status.code(), Some(4), "{stderr}");
    assert!(stderr.contains("out/origin.csv"), "{stderr}");
    assert!(folder.path().join("out/manifest.jsonl").exists(), "the output is kept");
}

/// Regression: reading an endless mesh or scene did not stop.
#[cfg(target_os = "linux")]
#[test]
fn endless_files_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let made = Command::new("mkfifo").arg("pipe").current_dir(folder.path()).status();
    assert!(made.unwrap().success());
    for (arguments, printed) in [
        ("run init --set mesh.type=file --set mesh.path=/dev/zero", "not a regular file"),
        ("run init --set mesh.type=file --set mesh.path=pipe", "not a regular file"),
        ("modes --mesh /dev/zero", "not a regular file"),
        ("check /dev/zero", "not a regular file"),
        ("check pipe", "not a regular file"),
        ("check /dev/stdin </dev/zero", "has more than"),
    ] {
        // A read that does not end exceeds the limit on memory or the limit on time.
        let limited = format!("ulimit -v 8000000; exec timeout 60 \"$0\" {arguments}");
        let end = Command::new("bash")
            .args(["-c", &limited, PROGRAM])
            .current_dir(folder.path())
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&end.stderr);
        assert_eq!(end.status.code(), Some(2), "{arguments}: {stderr}");
        assert!(stderr.contains(printed), "{arguments}: {stderr}");
    }
}

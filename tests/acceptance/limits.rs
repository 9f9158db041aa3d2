//! Tests of insufficient memory, and of Ctrl-C during any command. A command reports one error, returns the documented
//! exit code, and keeps its results.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // Helpers outside #[test] functions also fail the test.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use clap::CommandFactory;
use myovib_cli::cli::Cli;

use crate::harness::{PROGRAM, interrupted_after, myovib_in};

/// Runs the program with an address space of `kibibytes` KiB. Returns its exit code and its error output.
fn with_address_space(folder: &Path, kibibytes: u64, arguments: &str) -> (Option<i32>, String) {
    let limited = format!("ulimit -v {kibibytes}; exec \"$0\" {arguments}");
    let run =
        Command::new("bash").args(["-c", &limited, PROGRAM]).current_dir(folder).output().unwrap();
    let stderr = String::from_utf8_lossy(&run.stderr).into_owned();
    (run.status.code(), stderr)
}

/// Regression: a failed allocation aborted the program (134) or, in a thread, caused a segmentation fault (139).
#[test]
fn too_little_memory_is_one_error_and_code_4() {
    let folder = tempfile::tempdir().unwrap();
    let starts = |space: &u64| with_address_space(folder.path(), *space, "--version").0 == Some(0);
    let spaces = (0..60).map(|i| (40_000.0 * 1.1_f64.powi(i)) as u64);
    let spaces: Vec<u64> = spaces.filter(starts).take(12).collect();
    let mut failures = 0;
    for command in [
        "run init --quiet --overwrite --set mesh.refine=3 --set time.end=1e-3 --set fields=",
        "sweep init --quiet --overwrite --threads 8 --set time.end=1e-3 --set fields= --vary mesh.refine=0,1,2,3",
        "check muscle3d --threads 8",
    ] {
        for &space in &spaces {
            let (code, stderr) = with_address_space(folder.path(), space, command);
            let errors = stderr.lines().filter(|line| line.starts_with("error:"));
            match code {
                Some(0) => break,
                Some(4) => assert_eq!(errors.count(), 1, "{command}, {space}: {stderr}"),
                // If the C library cannot allocate the data of a thread, it ends the program itself.
                None if stderr.contains("Fatal glibc error") => continue,
                other => panic!("{command}, {space}: {other:?}, {stderr}"),
            }
            failures += 1;
        }
    }
    assert!(failures > 6, "{failures}");
}

/// Commands with the option `--memory` that factorize matrices, and their exit codes if the factors do not fit into
/// memory.
const FACTORIZING: [(&str, i32); 12] = [
    ("check init", 4),
    ("run init", 4),
    // A case that fails does not end the sweep.
    ("sweep init --vary mesh.refine=0,1", 0),
    ("modes init", 4),
    ("response tuned.toml --frequencies 1..2:2", 4),
    ("periodic init", 4),
    ("sensitivity tuned.toml", 4),
    ("fit tuned.toml --data tip.csv", 4),
    ("infsup", 4),
    ("table1", 4),
    ("table2 --rows 1 --t-end 0.001", 4),
    ("figure 5", 4),
];

/// Commands with the option `--memory` that run other commands or have no matrices.
const OTHERS: [&str; 4] = ["doctor", "figures", "movie", "synchronization"];

/// Regression: sweeps, fits and the commands for the paper's results ignored `--memory`.
#[test]
fn each_command_refuses_factors_above_its_memory() {
    let folder = tempfile::tempdir().unwrap();
    let init = include_str!("../../crates/scene/data/scenes/init.toml");
    let tuned = init.replace("y = { type", "response = { y = 100.0 }\ny = { type");
    let tuned = tuned
        + "[[parameter]]\nkey = \"material[0].c10\"\nlow = 1e3\n\
           [[output]]\nname = \"tip\"\nprobe = \"origin\"\ncolumn = \"u_y\"\n";
    fs::write(folder.path().join("tuned.toml"), tuned).unwrap();
    fs::write(folder.path().join("tip.csv"), "t,tip\n0.1,1e-3\n0.2,1e-3\n").unwrap();
    for (line, code) in FACTORIZING {
        let mut arguments: Vec<&str> = line.split(' ').collect();
        arguments.extend(["--memory", "1MiB"]);
        let run = myovib_in(folder.path(), &arguments);
        assert_eq!(run.code, code, "{line}: {}", run.stderr);
        assert!(run.stderr.contains("`--memory`"), "{line}: {}", run.stderr);
    }
    let first = |line: &'static str| line.split(' ').next().unwrap();
    let listed: Vec<&str> = FACTORIZING.iter().map(|(line, _)| first(line)).chain(OTHERS).collect();
    for command in Cli::command().get_subcommands() {
        let has_limit = command.get_arguments().any(|argument| argument.get_id() == "memory");
        let name = command.get_name();
        assert_eq!(has_limit, listed.contains(&name), "{name}");
    }
}

/// Regression: `movie` ignored Ctrl-C while it was drawing, and other commands ended without an exit code.
#[test]
fn ctrl_c_ends_each_command_within_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let run = "run init --quiet --set time.end=0.3 --set fields.interval=0.002";
    let run: Vec<&str> = run.split(' ').collect();
    assert_eq!(myovib_in(folder.path(), &run).code, 0);
    for (command, wait) in [
        ("movie out --out stored.gif --width-pixels 2000", 1.0),
        ("infsup --levels 6", 0.2),
        ("modes muscle3d", 0.2),
        ("check init --set mesh.refine=5", 0.2),
    ] {
        let arguments: Vec<&str> = command.split(' ').collect();
        let (code, after) = interrupted_after(wait, folder.path(), &arguments);
        assert_eq!(code, Some(130), "{command}");
        assert!(after < Duration::from_secs(1), "{command}: {after:?}");
    }
    // The movie contains the frames that were drawn before the signal.
    let film = fs::read(folder.path().join("stored.gif")).unwrap();
    let options = gif::DecodeOptions::new();
    let mut film = options.read_info(&film[..]).unwrap();
    let mut frames = 0;
    while film.read_next_frame().unwrap().is_some() {
        frames += 1;
    }
    assert!((1..150).contains(&frames), "{frames}");
}

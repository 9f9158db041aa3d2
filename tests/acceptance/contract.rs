//! Tests of rules that hold for all commands.

use std::fs;
use std::process::{Command, Stdio};

use crate::harness::{PROGRAM, document, myovib, myovib_in};
use crate::results::run_scene;

#[test]
fn version_names_the_linked_libraries() {
    let run = myovib(&["--version"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let words: Vec<&str> = run.stdout.split_whitespace().collect();
    assert_eq!(&words[..2], ["myovib", env!("CARGO_PKG_VERSION")]);
    for library in ["SUNDIALS", "KLU"] {
        let at = words.iter().position(|&word| word == library).expect(library);
        let major = words[at + 1].split('.').next().expect("a first number");
        assert!(major.parse::<u32>().is_ok(), "{library} version in {}", run.stdout);
    }
}

/// Checks that several processes are rejected in a build without the feature `mpi`, because all of them would compute
/// and write the same files.
#[test]
fn several_processes_need_a_program_that_is_built_for_them() {
    for (size, code) in [("1", 0), ("4", 2)] {
        let started = Command::new(PROGRAM)
            .arg("doctor")
            .env("OMPI_COMM_WORLD_SIZE", size)
            .output()
            .expect("the program starts");
        let reported = String::from_utf8_lossy(&started.stderr);
        assert_eq!(started.status.code(), Some(code), "{reported}");
        assert_eq!(reported.contains("--features mpi"), code == 2, "{reported}");
    }
}

#[test]
fn wrong_usage_is_code_2_with_one_message_on_standard_error() {
    for arguments in [
        &[][..],
        &["no-such-command"],
        &["doctor", "--no-such-option"],
        &["doctor", "--threads", "0"],
        &["doctor", "--threads", "many"],
    ] {
        let run = myovib(arguments);
        assert_eq!(run.code, 2, "{arguments:?}");
        assert_eq!(run.stdout, "", "{arguments:?}");
        assert!(!run.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn a_file_that_cannot_be_written_is_code_2_and_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = myovib_in(folder.path(), &["doctor", "--json=no/such/folder/d.json"]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.starts_with("error: "), "{}", run.stderr);
    assert!(run.stderr.contains("no/such/folder/d.json"), "{}", run.stderr);
    assert_eq!(run.stdout, "", "no results beside an error");
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
}

/// Checks that the error is reported before the computation, which may take hours.
#[test]
fn every_command_sees_at_once_that_its_document_cannot_be_written() {
    let folder = tempfile::tempdir().expect("a folder");
    for command in [
        "check init",
        "figure 3",
        "figures",
        "infsup",
        "modes",
        "movie chain",
        "response init",
        "run init",
        "sweep init --vary solid.bulk_modulus=1e5",
        "synchronization",
        "table1",
        "table2",
    ] {
        for target in ["no/such.json", "."] {
            let json = format!("--json={target}");
            let words = command.split(' ').chain([json.as_str()]);
            let run = myovib_in(folder.path(), &words.collect::<Vec<_>>());
            assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{command}");
            let message = format!("invalid value '{target}' for '--json");
            assert!(run.stderr.contains(&message), "{command}: {}", run.stderr);
        }
    }
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
}

#[test]
fn a_closed_pipe_is_not_a_failure() {
    for arguments in [&["schema"][..], &["schema", "--markdown"], &["init", "-"]] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_myovib"))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let end = child.wait_with_output().expect("an end");
        let stderr = String::from_utf8_lossy(&end.stderr);
        assert_eq!((end.status.code(), &*stderr), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn json_goes_to_standard_output_alone_or_to_a_file_beside_the_text() {
    let folder = tempfile::tempdir().expect("a folder");
    let on_stdout = myovib(&["doctor", "--json"]);
    document(&on_stdout.stdout, "doctor");
    assert!(on_stdout.stdout.starts_with("{\n  \"schema\": "));

    let beside = myovib_in(folder.path(), &["doctor", "--json=d.json"]);
    assert!(beside.stdout.contains("SUNDIALS"));
    let text = fs::read_to_string(folder.path().join("d.json")).expect("the document");
    assert_eq!(text, on_stdout.stdout);
}

#[test]
fn help_shows_examples() {
    let run = myovib(&["doctor", "--help"]);
    assert_eq!(run.code, 0);
    assert!(run.stdout.contains("Examples:\n  myovib doctor"), "{}", run.stdout);
}

/// Issue 15, E8: checks that the guide explains in one place how the names of unknowns correspond.
#[test]
fn the_guide_has_the_names_of_all_blocks() {
    let folder = tempfile::tempdir().expect("a folder");
    let sets = [
        "time.end=0.01",
        "integrator.method=bdf",
        "solid.formulation=rate",
        "fields=",
        "integrator.error_test.exclude=[\"p\", \"p_rate\"]",
    ];
    run_scene(folder.path(), "init", "out", &sets);
    let text = fs::read_to_string(folder.path().join("out/run.json")).expect("run.json");
    let found = document(&text, "run");
    let guide = include_str!("../../docs/src/statistics.md");
    for name in ["u", "v", "p", "p_rate"] {
        assert!(guide.contains(&format!("| `{name}`")), "{name}");
        assert!(found["atol"][name].is_number(), "{name}: {found}");
        assert!(found["indices"][name].is_number(), "{name}");
    }
    assert_eq!(found["atol"].as_object().map(|atol| atol.len()), Some(4));
    assert_eq!(found["suppressed"], serde_json::json!(["p", "p_rate"]));
    let table = fs::read_to_string(folder.path().join("out/origin.csv")).expect("the table");
    assert!(table.starts_with("t,u_x,u_y,p\n"), "{table:.40}");
}

//! Runs the program under test.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::Duration;

/// The program under test: the users', or the maintainers'.
pub(crate) const PROGRAM: &str = match option_env!("CARGO_BIN_EXE_myovib") {
    Some(program) => program,
    None => match option_env!("CARGO_BIN_EXE_myovib-bench") {
        Some(program) => program,
        None => "",
    },
};

/// What a run left.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs `myovib` with these arguments, in `folder`, without colours.
pub(crate) fn myovib_in(folder: &Path, arguments: &[&str]) -> Run {
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new(PROGRAM)
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .expect("the program starts");
    Run {
        code: status.code().expect("the program ends by itself"),
        stdout: String::from_utf8(stdout).expect("standard output is UTF-8"),
        stderr: String::from_utf8(stderr).expect("standard error is UTF-8"),
    }
}

/// Runs `myovib` with these arguments where no output is written.
pub(crate) fn myovib(arguments: &[&str]) -> Run {
    myovib_in(Path::new("."), arguments)
}

/// The document in `text`, with the envelope all commands share checked.
pub(crate) fn document(text: &str, command: &str) -> serde_json::Value {
    let value: serde_json::Value = serde_json::from_str(text).expect("valid JSON");
    assert_eq!(value["schema"], format!("myovib/{command}/1"));
    for name in ["myovib", "git", "sundials", "klu"] {
        let version = value["versions"][name].as_str();
        assert!(
            version.is_some_and(|v| !v.is_empty()),
            "versions.{name} in {text}"
        );
    }
    value
}

/// The exit code of a program that Ctrl-C meets in the midst of its work.
pub(crate) fn code_of_interrupted(folder: &Path, arguments: &[&str]) -> Option<i32> {
    let mut run = Command::new(PROGRAM)
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    // Long enough to begin, and a small part of what the run takes.
    thread::sleep(Duration::from_secs(3));
    let sent = Command::new("kill")
        .args(["-INT", &run.id().to_string()])
        .status();
    assert!(sent.expect("kill").success());
    run.wait().expect("an end").code()
}

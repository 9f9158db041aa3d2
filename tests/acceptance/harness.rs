//! Runs the program under test.

use std::path::Path;
use std::process::{Command, Output};

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
    } = Command::new(env!("CARGO_BIN_EXE_myovib"))
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

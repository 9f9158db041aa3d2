//! Functions that run the program under test.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Program under test, either for users or for maintainers.
pub(crate) const PROGRAM: &str = match option_env!("CARGO_BIN_EXE_myovib") {
    Some(program) => program,
    None => match option_env!("CARGO_BIN_EXE_myovib-bench") {
        Some(program) => program,
        None => "",
    },
};

/// Result of a run.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Run {
    /// Checks the exit code.
    #[track_caller]
    pub(crate) fn with_code(self, code: i32) -> Self {
        assert_eq!(self.code, code, "{}", self.stderr);
        self
    }
}

/// Runs `myovib` in `folder` with these arguments and without colors.
pub(crate) fn myovib_in(folder: &Path, arguments: &[&str]) -> Run {
    let Output { status, stdout, stderr } = Command::new(PROGRAM)
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

/// Runs `myovib` with these arguments, which must not write any files.
pub(crate) fn myovib(arguments: &[&str]) -> Run {
    myovib_in(Path::new("."), arguments)
}

/// Parses the document in `text`, and checks the entries that all commands have in common.
pub(crate) fn document(text: &str, command: &str) -> serde_json::Value {
    let value: serde_json::Value = serde_json::from_str(text).expect("valid JSON");
    assert_eq!(value["schema"], format!("myovib/{command}/1"));
    for name in ["myovib", "git", "sundials", "klu"] {
        let version = value["versions"][name].as_str();
        assert!(version.is_some_and(|v| !v.is_empty()), "versions.{name} in {text}");
    }
    value
}

/// Returns the CPU time of a process, or `None` if the process has ended.
fn cpu_seconds(process: u32) -> Option<f64> {
    let text = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name of the program is in parentheses and may contain spaces.
    let mut fields = text.rsplit(')').next()?.split_whitespace();
    let state = fields.next()?;
    let ticks: Vec<f64> = fields.skip(10).take(2).filter_map(|f| f.parse().ok()).collect();
    // Linux counts CPU time in hundredths of a second.
    (state != "Z").then(|| ticks.iter().sum::<f64>() / 100.0)
}

/// Returns the exit code of a program that is interrupted by Ctrl-C while it works.
pub(crate) fn code_of_interrupted(folder: &Path, arguments: &[&str]) -> Option<i32> {
    // This time is long enough to start the program, and only a small part of the run.
    interrupted_after(1.0, folder, arguments).0
}

/// Interrupts a program with Ctrl-C after `wait` seconds of CPU time. CPU time does not depend on the load of the
/// machine. Returns the exit code of the program and the time that it took to end.
pub(crate) fn interrupted_after(
    wait: f64,
    folder: &Path,
    arguments: &[&str],
) -> (Option<i32>, Duration) {
    let mut run = Command::new(PROGRAM)
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    while cpu_seconds(run.id()).is_some_and(|seconds| seconds < wait) {
        thread::yield_now();
    }
    let sent = Command::new("kill").args(["-INT", &run.id().to_string()]).status();
    assert!(sent.expect("kill").success());
    let since = Instant::now();
    (run.wait().expect("an end").code(), since.elapsed())
}

//! Checks that no command overwrites files of other programs, and that a closed standard output or standard error does
//! not end a computation.
#![cfg(unix)]
#![allow(clippy::unwrap_used)] // Helpers outside #[test] functions also fail the test.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clap::CommandFactory;
use myovib_cli::cli::Cli;

use crate::harness::{PROGRAM, myovib_in};

/// Motion of two elements, which takes a fraction of a second.
pub(crate) const SCENE: &str = r#"
[time]
end = 0.02
[mesh]
type = "rectangle"
width = 0.1
height = 0.02
cells = [1, 1]
[solid]
bulk_modulus = 1e5
[[material]]
law = "neo-hooke"
density = 1.1e3
shear_modulus = 1e4
[[fixed]]
group = "left"
[[traction]]
group = "top"
y = { type = "step", value = 20.0, rise = 0.05 }
[integrator]
method = "radau5"
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.01]
interval = 0.01
[[parameter]]
key = "solid.bulk_modulus"
"#;

/// Quick command line for each command that has the option `--json`.
const COMMANDS: [&str; 17] = [
    "check scene.toml",
    "doctor",
    "figure 4",
    "figures --t-end 1",
    "fit scene.toml --data data.csv",
    "infsup --levels 1",
    "modes scene.toml --count 1",
    "movie chain --from 0 --to 0.1 --width-pixels 64",
    "periodic scene.toml --set traction[0].y={type=\"sine\",amplitude=1.0,frequency=100.0}",
    "response scene.toml --frequencies 1,2 --set traction[0].response={y=1.0}",
    "run scene.toml",
    "scenes",
    "sensitivity scene.toml",
    "sweep scene.toml --vary solid.bulk_modulus=1e5,2e5",
    "synchronization --t-end 1 --gamma 10",
    "table1",
    "table2 --rows 1 --t-end 0.02",
];

/// Commands with an option that names an output file. The option `--json` is not listed, because all of the commands
/// above have it.
const FILES: [(&str, &str); 6] = [
    ("infsup", "plot"),
    ("modes", "svg"),
    ("modes", "vtu"),
    ("movie", "out"),
    ("sweep", "slurm"),
    ("table2", "csv"),
];

/// Commands with an option that names an output folder, and a file or folder that they write in it.
const FOLDERS: [(&str, &str); 10] = [
    ("figure", "figure4.svg"),
    ("figures", "figure7.csv"),
    ("fit", "fit.json"),
    ("periodic", "tip.csv"),
    ("response", "tip.csv"),
    ("run", "report.html"),
    ("sensitivity", "sensitivity.svg"),
    ("sweep", "case-0002"),
    ("synchronization", "synchronization.svg"),
    ("table2", "table2-1"),
];

/// Names of the arguments that are input files.
const READ: [&str; 4] = ["scene", "mesh", "data", "file"];

fn line_of(command: &str) -> &'static str {
    let is_of = |line: &&&str| line.split(' ').next() == Some(command);
    COMMANDS.iter().find(is_of).unwrap()
}

/// Creates a folder with a scene, data, and files that belong to the user.
fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("scene.toml"), SCENE).unwrap();
    let rows = (0..5).map(|i| format!("{}\n", f64::from(i) * 0.005).replace('\n', ",0\n"));
    fs::write(path.join("data.csv"), "t,tip.u_y\n".to_owned() + &rows.collect::<String>()).unwrap();
    fs::write(path.join("mine.txt"), "precious").unwrap();
    fs::write(path.join("mine.json"), "{\n  \"schema\": \"mine\"\n}\n").unwrap();
    symlink("mine.txt", path.join("link")).unwrap();
    fs::create_dir(path.join("folder")).unwrap();
    fs::write(path.join("folder/mine"), "precious").unwrap();
    let made = Command::new("mkfifo").arg(path.join("pipe")).status();
    assert!(made.unwrap().success());
    folder
}

/// Returns all files below a folder with their contents. For links, pipes and folders, returns the type instead.
fn tree(folder: &Path) -> BTreeMap<PathBuf, String> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap()) {
        let (path, kind) = (entry.path(), entry.file_type().unwrap());
        if kind.is_dir() {
            all.extend(tree(&path));
            all.insert(path, "folder".to_owned());
        } else if kind.is_file() {
            let bytes = fs::read(&path).unwrap();
            all.insert(path, String::from_utf8_lossy(&bytes).into_owned());
        } else {
            all.insert(path, format!("{kind:?}"));
        }
    }
    all
}

fn words<'a>(line: &'a str, more: &'a [&'a str]) -> Vec<&'a str> {
    line.split(' ').chain(more.iter().copied()).collect()
}

/// Runs a command that must fail and must not change anything.
fn assert_refused(folder: &Path, arguments: &[&str]) {
    let before = tree(folder);
    let run = myovib_in(folder, arguments);
    assert_eq!(run.code, 2, "{arguments:?}: {}", run.stderr);
    assert_eq!(tree(folder), before, "{arguments:?}: {}", run.stderr);
}

/// Checks that the tables above are complete. New options and commands must be added there.
#[test]
fn the_tables_have_every_command_and_every_option_that_names_a_path() {
    for command in Cli::command().get_subcommands() {
        let name = command.get_name();
        let has_json = command.get_arguments().any(|arg| arg.get_id() == "json");
        let is_listed = COMMANDS.iter().any(|line| line.split(' ').next() == Some(name));
        assert_eq!(has_json, is_listed, "{name}");
        for argument in command.get_arguments() {
            let id = argument.get_id().as_str();
            let values = argument.get_value_names().unwrap_or_default();
            let is = |kind: &str| values.iter().any(|value| value.starts_with(kind));
            let is_folder = FOLDERS.iter().any(|(command, _)| *command == name) && id == "out";
            let is_file = id == "json" || FILES.contains(&(name, id)) || READ.contains(&id);
            assert_eq!(is("DIR"), is_folder, "{name} {id}");
            assert!(!is("FILE") || is_file, "{name} {id}");
        }
    }
}

/// Regression: `modes --json mine.toml` replaced the scene, and options such as `--slurm` replaced any file.
#[test]
fn a_file_that_an_option_names_is_not_replaced_unless_the_program_made_it() {
    let folder = place();
    let json = COMMANDS.map(|line| (line, "--json".to_owned()));
    let others = FILES.map(|(command, option)| (line_of(command), format!("--{option}")));
    for (line, option) in json.iter().chain(&others) {
        for target in ["mine.txt", "mine.json", "scene.toml", "data.csv", "link", "folder", "pipe"]
        {
            let given = format!("{option}={target}");
            assert_refused(folder.path(), &words(line, &[&given]));
        }
    }
    for target in ["mine.txt", "link", "folder", "pipe"] {
        assert_refused(folder.path(), &["init", target]);
    }
    // A positional argument after `--json` is not taken as the file of `--json`.
    let before = fs::read_to_string(folder.path().join("scene.toml")).unwrap();
    let run =
        myovib_in(folder.path(), &["modes", "--count", "1", "--json", "scene.toml"]).with_code(0);
    assert!(run.stdout.starts_with("{\n  \"schema\": \"myovib/modes/1\""));
    assert_eq!(fs::read_to_string(folder.path().join("scene.toml")).unwrap(), before);
    // The program may replace its own file.
    for _ in 0..2 {
        myovib_in(folder.path(), &["doctor", "--json=own.json"]).with_code(0);
    }
}

/// Regression: sweeps and sensitivities replaced other results, and `--overwrite` removed files that belonged to the
/// user.
#[test]
fn a_folder_of_somebody_elses_files_or_of_another_command_is_left_as_it_is() {
    let folder = place();
    myovib_in(folder.path(), &words(line_of("sweep"), &["--out", "a-sweep", "--quiet"]))
        .with_code(0);
    myovib_in(folder.path(), &words(line_of("run"), &["--out", "a-run", "--quiet"])).with_code(0);
    // These files are results of another command, although the program wrote them.
    assert_refused(folder.path(), &["doctor", "--json=a-run/run.json"]);
    assert_refused(&folder.path().join("a-sweep"), &["doctor", "--json=sweep.json"]);
    for (command, name) in FOLDERS {
        let own = folder.path().join(format!("of-{command}"));
        fs::create_dir(&own).unwrap();
        fs::write(own.join(name), "precious").unwrap();
        let own = format!("of-{command}");
        let has_overwrite = ["fit", "run", "sensitivity", "sweep"].contains(&command);
        let modes = if has_overwrite { &[&[][..], &["--overwrite"]][..] } else { &[&[][..]] };
        for mode in modes {
            for target in ["mine.txt", "link", "pipe", &own, "a-run", "a-sweep"] {
                let of_its_own = target == format!("a-{command}");
                if of_its_own && (!mode.is_empty() || command == "sweep") {
                    continue;
                }
                let out = [&["--out", target][..], mode].concat();
                assert_refused(folder.path(), &words(line_of(command), &out));
            }
        }
    }
    // The folder contains a different sweep.
    let other = [
        "sweep",
        "scene.toml",
        "--vary",
        "solid.rayleigh_stiffness=1e-4,2e-4",
        "--quiet",
        "--out",
        "a-sweep",
    ];
    assert_refused(folder.path(), &other);
    myovib_in(folder.path(), &[&other[..], &["--overwrite"]].concat()).with_code(0);
}

/// Starts a command whose standard output and standard error are closed pipes.
fn start_without_readers(folder: &Path, line: &str) -> Child {
    let mut child = Command::new(PROGRAM)
        .args(words(line, &[]))
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop((child.stdout.take(), child.stderr.take()));
    child
}

/// Regression: if the pipe was closed, the first line on standard error ended a run with exit code 101.
#[test]
fn closed_output_streams_do_not_change_exit_codes_and_files() {
    let folder = place();
    let path = folder.path();
    let folder_of = |line: &str| {
        let command = line.split(' ').next();
        let known = FOLDERS.iter().find(|(name, _)| command == Some(name));
        known.map(|(command, name)| (format!("of-{command}"), *name))
    };
    // The indices of all of the paper's equations take a minute to compute, and they are not written to a file.
    let commands = COMMANDS.iter().filter(|line| **line != "table1");
    let others = ["schema", "man", "completions bash", "init -", "--help"];
    let started = commands.chain(&others).map(|line| match folder_of(line) {
        Some((out, _)) => (*line, start_without_readers(path, &format!("{line} --out {out}"))),
        None => (*line, start_without_readers(path, line)),
    });
    for (line, mut child) in started.collect::<Vec<_>>() {
        assert_eq!(child.wait().unwrap().code(), Some(0), "{line}");
        let kept = folder_of(line).is_none_or(|(out, name)| path.join(out).join(name).exists());
        assert!(kept, "{line}");
    }
    // These commands write to standard error: usage errors, warnings, and notes on failed cases.
    for (line, code) in [
        ("run nosuch.toml", 2),
        ("run scene.toml --out of-run", 2),
        ("run scene.toml --nonsense", 2),
        ("run scene.toml --out stopped --set integrator.max_steps=2", 3),
        ("sweep scene.toml --vary integrator.max_steps=2,3 --out stopped-cases", 0),
    ] {
        let end = start_without_readers(path, line).wait().unwrap();
        assert_eq!(end.code(), Some(code), "{line}");
    }
    // Here, the streams are closed from the start.
    for (line, code) in [("run scene.toml --out closed", 0), ("run nosuch.toml", 2)] {
        let closed = format!("exec \"$0\" {line} >&- 2>&-");
        let end = Command::new("bash").args(["-c", &closed, PROGRAM]).current_dir(path).status();
        assert_eq!(end.unwrap().code(), Some(code), "{line}");
    }
    assert!(path.join("closed/report.html").is_file());
}

/// Checks that a full disk behind standard output results in exit code 4, and that results in files are kept.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_code_4_and_files_are_kept() {
    let folder = place();
    for line in ["doctor", "run scene.toml", "run scene.toml --overwrite --json"] {
        let full = format!("exec \"$0\" {line} --quiet >/dev/full");
        let end =
            Command::new("bash").args(["-c", &full, PROGRAM]).current_dir(folder.path()).output();
        let end = end.unwrap();
        assert_eq!(end.status.code(), Some(4), "{line}: {}", String::from_utf8_lossy(&end.stderr));
    }
    assert!(folder.path().join("out/report.html").is_file());
}

/// Regression: a line break in an argument ended the comment in the job script, and the rest of the argument ran as a
/// command.
#[test]
fn arguments_with_line_breaks_cannot_add_commands_to_a_job_script() {
    let folder = place();
    let title = "title=\"\"\"a\ntouch broken-out\n'; touch broken-out; '\"\"\"";
    let out = "o\ntouch broken-out\n";
    let script = "j\ntouch broken-out.sh";
    let common = [
        "sweep",
        "scene.toml",
        "--vary",
        "solid.bulk_modulus=1e5,2e5",
        "--set",
        title,
        "--out",
        out,
    ];
    let slurm = format!("--slurm={script}");
    myovib_in(folder.path(), &[&common[..], &[&slurm]].concat()).with_code(0);
    let computed = |arguments: &[&str]| {
        let end = Command::new("bash")
            .arg(folder.path().join(script))
            .args(arguments)
            .env("SLURM_ARRAY_TASK_ID", "1")
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(end.status.success(), "{}", String::from_utf8_lossy(&end.stderr));
    };
    computed(&[]);
    computed(&["--collect"]);
    assert!(folder.path().join(out).join("case-0001/run.json").is_file());
    assert!(!folder.path().join("broken-out").exists());
}

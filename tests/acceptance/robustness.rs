//! Tests of guarantees for the folder of a run: no results are invented or lost, no temporary files remain, only one
//! run at a time uses the folder, and the run ends with a message. Each test is the regression test of a defect.

#![allow(clippy::unwrap_used)] // Helpers outside #[test] functions also fail the test.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::harness::{PROGRAM, myovib_in};

/// Command for a run of less than a second that writes a checkpoint at 0.16 s, at the end of a step.
const SHORT: [&str; 10] = [
    "run",
    "init",
    "--quiet",
    "--set",
    "time.end=0.2",
    "--set",
    "checkpoint.interval=0.16",
    "--set",
    "integrator.max_step=0.002",
    "--resume",
];

/// Leaves `out` in the state of a run that was killed right after the checkpoint. Returns the table of the probe.
fn killed(folder: &Path) -> String {
    myovib_in(folder, &[&SHORT[..9], &["--set", "time.end=0.16"]].concat()).with_code(0);
    fs::remove_file(folder.join("out/run.json")).unwrap();
    fs::read_to_string(folder.join("out/origin.csv")).unwrap()
}

fn first_rows(text: &str, n: usize) -> String {
    text.split_inclusive('\n').take(n + 1).collect()
}

#[test]
fn rows_that_a_table_has_lost_are_not_invented() {
    let folder = tempfile::tempdir().unwrap();
    let written = killed(folder.path());
    let csv = folder.path().join("out/origin.csv");
    let short = first_rows(&written, 5);
    fs::write(&csv, &short).unwrap();
    let run = myovib_in(folder.path(), &SHORT).with_code(2);
    for printed in ["origin.csv", "rows would be missing", "--overwrite"] {
        assert!(run.stderr.contains(printed), "{printed}: {}", run.stderr);
    }
    assert_eq!(fs::read_to_string(&csv).unwrap(), short, "left as it is");
}

#[test]
fn a_field_file_that_is_gone_is_not_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let fields = ["--set", "fields.interval=0.05"];
    let first = [&SHORT[..9], &["--set", "time.end=0.16"], &fields].concat();
    assert_eq!(myovib_in(folder.path(), &first).code, 0);
    fs::remove_file(folder.path().join("out/fields_00001.vtu")).unwrap();
    let run = myovib_in(folder.path(), &[&SHORT[..], &fields].concat()).with_code(2);
    for printed in ["fields_00001.vtu", "--overwrite"] {
        assert!(run.stderr.contains(printed), "{printed}: {}", run.stderr);
    }
}

#[test]
fn an_incomplete_last_row_is_removed_with_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let written = killed(folder.path());
    let csv = folder.path().join("out/origin.csv");
    fs::write(&csv, written + "1.7e-1,\0\0\0").unwrap();
    let run = myovib_in(folder.path(), &SHORT).with_code(0);
    assert!(run.stderr.contains("10 bytes"), "{}", run.stderr);
    let text = fs::read_to_string(&csv).unwrap();
    let times = text.lines().skip(1).filter_map(|line| line.split(',').next());
    let times: Vec<f64> = times.map(|word| word.parse().unwrap()).collect();
    assert_eq!(times.len(), 21);
    for (k, t) in times.iter().enumerate() {
        assert!((t - 0.01 * k as f64).abs() < 1e-15, "{times:?}"); // products have rounding errors
    }
}

#[test]
fn checkpoints_do_not_change_a_run() {
    let folder = tempfile::tempdir().unwrap();
    for method in ["bdf", "radau5"] {
        let table = |every: &str| {
            let out = format!("{method}-{every}");
            let (method, every) =
                (format!("integrator.method={method}"), format!("checkpoint.interval={every}"));
            let arguments = ["run", "init", "--quiet", "--set", "time.end=0.2", "--out", &out];
            let sets = ["--set", &method, "--set", &every];
            myovib_in(folder.path(), &[&arguments[..], &sets].concat()).with_code(0);
            fs::read_to_string(folder.path().join(out).join("origin.csv")).unwrap()
        };
        assert_eq!(table("1"), table("0.001"), "{method}");
    }
}

#[test]
fn a_finished_run_is_not_resumed_whatever_its_checkpoints() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(myovib_in(folder.path(), &SHORT[..9]).code, 0);
    let run = myovib_in(folder.path(), &SHORT).with_code(2);
    assert!(run.stderr.contains("the run is finished"), "{}", run.stderr);
}

#[test]
fn a_run_of_a_changed_mesh_is_not_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("a.msh");
    // Some text editors write a byte order mark.
    let text = format!("\u{feff}{}", include_str!("../../data/meshes/muscle.msh"));
    fs::write(&mesh, &text).unwrap();
    let file = ["--set", "mesh.type=file", "--set", "mesh.path=a.msh"];
    let scene = include_str!("../../data/scenes/init.toml");
    fs::write(folder.path().join("init"), scene).unwrap();
    myovib_in(folder.path(), &[&SHORT[..9], &file].concat()).with_code(0);
    fs::remove_file(folder.path().join("out/run.json")).unwrap();
    fs::write(&mesh, text.replacen("0.06", "0.0600001", 1)).unwrap();
    let again = myovib_in(folder.path(), &[&SHORT[..], &file].concat()).with_code(2);
    assert!(again.stderr.contains("`a.msh`"), "{}", again.stderr);
}

#[test]
fn overwrite_leaves_nothing_of_the_earlier_run() {
    let folder = tempfile::tempdir().unwrap();
    let fields = ["--set", "fields.interval=0.1"];
    assert_eq!(myovib_in(folder.path(), &[&SHORT[..9], &fields].concat()).code, 0);
    let statics = ["run", "cook-static", "--quiet", "--overwrite"];
    assert_eq!(myovib_in(folder.path(), &statics).code, 0);
    for gone in ["origin.csv", "fields_00001.vtu", "checkpoint.json"] {
        assert!(!folder.path().join("out").join(gone).exists(), "{gone}");
    }
}

#[test]
fn one_run_at_a_time_writes_into_a_folder_and_signals_keep_its_output() {
    let folder = tempfile::tempdir().unwrap();
    for signal in ["-TERM", "-HUP"] {
        let mut first = Command::new(PROGRAM)
            .args(["run", "init", "--quiet", "--overwrite", "--set", "time.end=1000"])
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        // The run is in progress once its table has rows.
        let csv = folder.path().join("out/origin.csv");
        let since = Instant::now();
        while !fs::read_to_string(&csv).is_ok_and(|text| text.lines().count() > 2) {
            assert!(since.elapsed() < Duration::from_secs(60), "it does not start");
            std::thread::yield_now();
        }
        let second = myovib_in(folder.path(), &["run", "init", "--overwrite"]).with_code(2);
        assert!(second.stderr.contains("another process is writing to"), "{}", second.stderr);
        let sent = Command::new("kill").args([signal, &first.id().to_string()]).status();
        assert!(sent.unwrap().success());
        assert_eq!(first.wait().unwrap().code(), Some(130), "{signal}");
        let document = fs::read_to_string(folder.path().join("out/run.json")).unwrap();
        assert!(document.contains("\"interrupted\""));
        fs::remove_dir_all(folder.path().join("out")).unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_code_4_and_keeps_the_output() {
    let folder = tempfile::tempdir().unwrap();
    // A limit on the file size simulates a full disk. Previously, the signal for this limit ended the program.
    let run = Command::new("bash")
        .args(["-c", "ulimit -f 100; exec \"$0\" run init --quiet --set probe[0].interval=1e-5 --set fields= --set time.end=0.2", PROGRAM])
        .current_dir(folder.path())
        .env("NO_COLOR", "1")
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(4), "{stderr}");
    assert!(stderr.contains("origin.csv"), "{stderr}");
    let text = fs::read_to_string(folder.path().join("out/origin.csv")).unwrap();
    assert!(text.lines().count() > 100);
}

#[test]
fn unreasonable_requests_are_rejected_with_a_message() {
    let folder = tempfile::tempdir().unwrap();
    for (set, printed) in [
        ("time.end=5e-324", "implausible"),
        ("time.end=1e300", "implausible"),
        ("time.end=1e19", "too many rows"),
        ("probe[0].interval=1e-12", "too many rows"),
        ("fields.interval=1e-12", "too many files"),
        ("checkpoint.interval=1e-29", "too many checkpoints"),
    ] {
        let run = myovib_in(folder.path(), &["run", "init", "--set", set]);
        assert_eq!(run.code, 2, "{set}: {}", run.stderr);
        assert!(run.stderr.contains(printed), "{set}: {}", run.stderr);
    }
    let probe = "[[probe]]\ntype = \"energy\"\nname = \"p";
    let probes: String = (0..100_000).map(|i| format!("{probe}{i}\"\n")).collect();
    let scene = include_str!("../../data/scenes/init.toml").to_owned() + &probes;
    fs::write(folder.path().join("many.toml"), scene).unwrap();
    let started = Instant::now();
    let run = myovib_in(folder.path(), &["run", "many.toml"]);
    assert!(run.stderr.contains("probe"), "{}", run.stderr);
    // Previously, this took minutes. Now, it takes as long as reading 3 MB.
    assert!(started.elapsed() < Duration::from_secs(20));
    assert!(!folder.path().join("out").exists());
}

#[test]
fn names_contain_no_terminal_commands() {
    let folder = tempfile::tempdir().unwrap();
    let name = "fixed[0].group=a\u{1b}[2Jb";
    let run = myovib_in(folder.path(), &["run", "init", "--set", name]);
    assert_eq!(run.code, 2);
    assert!(!run.stderr.contains('\u{1b}'), "{}", run.stderr);
    assert!(run.stderr.contains("\\u{1b}[2Jb"), "{}", run.stderr);
}

#[cfg(unix)]
#[test]
fn links_and_pipes_are_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let precious = folder.path().join("precious");
    fs::create_dir(&out).unwrap();
    fs::write(&precious, "mine").unwrap();
    std::os::unix::fs::symlink(&precious, out.join("origin.csv")).unwrap();
    myovib_in(folder.path(), &SHORT[..9]).with_code(2);
    // The link was not created by the program.
    myovib_in(folder.path(), &[&SHORT[..9], &["--overwrite"]].concat()).with_code(2);
    assert_eq!(fs::read_to_string(&precious).unwrap(), "mine");
    let there = fs::symlink_metadata(out.join("origin.csv")).unwrap();
    assert!(there.is_symlink());
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    // Not even the superuser can create files in this folder.
    myovib_in(folder.path(), &["doctor", "--json=/sys/document.json"]).with_code(2);
    let run = myovib_in(folder.path(), &["doctor", "--json=pipe"]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("pipe"), "{}", run.stderr);
}

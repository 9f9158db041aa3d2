//! Tests of runs on several processes, which `mpirun` starts.
#![allow(clippy::unwrap_used, reason = "tests are exempt")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_myovib");

/// Spindle of two materials that is pulled from the start. One of the materials contracts and is viscous. The loads are
/// smooth until the end.
const SCENE: &str = r#"
[time]
end = 0.3

[mesh]
type = "muscle3d"
cells = [10, 2, 2]

[solid]
bulk_modulus = 1e5
rayleigh_mass = 1.0

[[material]]
group = "muscle"
law = "mooney-rivlin"
density = 1.1e3
c10 = 1e4
c01 = 2e2
fiber = "fiber"
viscosity = 5.0
active = { type = "given", tension = { type = "step", value = 2e3, rise = 0.3 } }

[[material]]
group = "tendon"
law = "mooney-rivlin"
density = 1.1e3
c10 = 1e5

[[fixed]]
group = "fixed"

[[traction]]
group = "load"
z = { type = "step", value = 500.0, rise = 0.3 }

[integrator]
method = "radau5"
rtol = 1e-7
max_steps = 50

[[probe]]
name = "middle"
type = "point"
at = [0.0, 0.0, 0.0]
quantities = ["u", "v", "p"]

[checkpoint]
interval = 0.01
"#;

/// Creates a folder with the scene. The lines given in `changes` are replaced.
fn folder(changes: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scene = changes.iter().fold(SCENE.to_owned(), |scene, (old, new)| {
        assert!(scene.contains(old), "{old}");
        scene.replace(old, new)
    });
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

/// Returns an `mpirun` command with these arguments. Open MPI must permit more ranks than cores, and must permit the
/// user root.
fn mpirun(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new("mpirun");
    command.args(arguments).current_dir(folder);
    command.envs([
        ("NO_COLOR", "1"),
        ("OPENBLAS_NUM_THREADS", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
    ]);
    command
}

/// Runs the scene in the folder `out` on `ranks` ranks, or without `mpirun` if `ranks` is 0. Returns the text on
/// standard error.
fn run(folder: &Path, ranks: usize, out: &str) -> String {
    let count = ranks.to_string();
    let arguments = ["run", "scene.toml", "--quiet", "--out", out];
    let mut command = match ranks {
        0 => Command::new(PROGRAM),
        _ => mpirun(folder, &["-n", &count, PROGRAM]),
    };
    let Output { status, stderr, .. } =
        command.args(arguments).current_dir(folder).output().unwrap();
    let stderr = String::from_utf8(stderr).unwrap();
    // Exit code 3 means that the step limit was reached.
    assert!(matches!(status.code(), Some(0 | 3)), "{ranks} ranks: {stderr}");
    stderr
}

fn json(path: PathBuf) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Returns the columns of a probe.
fn columns(folder: &Path, out: &str) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(folder.join(out).join("middle.csv")).unwrap();
    let rows = text.lines().skip(1);
    let rows: Vec<Vec<f64>> =
        rows.map(|row| row.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    (0..rows[0].len()).map(|k| rows.iter().map(|row| row[k]).collect()).collect()
}

/// Checks that trajectories on 1, 2 and 4 ranks are equal to the trajectories of a single process within 1e-10 of the
/// maximum, and that the numbers of steps are equal.
fn assert_ranks_agree(changes: &[(&str, &str)]) {
    let folder = folder(changes);
    let folder = folder.path();
    let work = |out: &str| {
        let document = json(folder.join(out).join("run.json"));
        ["steps", "newton_iterations"].map(|key| document[key].as_u64().unwrap())
    };
    run(folder, 0, "alone");
    let alone = columns(folder, "alone");
    assert!(work("alone")[0] == 50, "as many steps as allowed: {:?}", work("alone"));
    for ranks in [1, 2, 4] {
        let out = format!("by {ranks}");
        let reported = run(folder, ranks, &out);
        assert!(reported.contains(&format!("{ranks} processes share")), "{reported}");
        println!("{ranks} ranks: steps, Newton iterations {:?}", work(&out));
        assert_eq!(work(&out), work("alone"), "{ranks} ranks");
        for (one, many) in alone.iter().zip(columns(folder, &out)) {
            let largest = one.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let pairs = one.iter().zip(&many);
            let off = pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(one.len() == many.len() && off <= 1e-10 * largest, "{off:e} of {largest:e}");
        }
    }
}

#[test]
fn ranks_agree_on_a_motion_by_radau() {
    assert_ranks_agree(&[]);
}

/// Checks a motion with β, for which Newton matrices are nonsymmetric and passes over the elements compute rates.
#[test]
fn ranks_agree_on_a_damped_motion_by_bdf() {
    assert_ranks_agree(&[
        ("rayleigh_mass = 1.0", "rayleigh_stiffness = 1e-3"),
        ("\"radau5\"", "\"bdf\""),
        ("viscosity = 5.0\n", ""),
    ]);
}

#[test]
fn an_equilibrium_is_that_of_the_program_alone() {
    let folder = folder(&[("[time]", "analysis = \"static\"\n[time]")]);
    let folder = folder.path();
    run(folder, 0, "alone");
    run(folder, 2, "by 2");
    let (alone, both) = (columns(folder, "alone"), columns(folder, "by 2"));
    for (a, b) in alone.iter().zip(both) {
        // The last increments of Newton's method are 1e-10 of the solution.
        assert!((a[0] - b[0]).abs() <= 1e-10 * a[0].abs().max(1e-12), "{a:?} {b:?}");
    }
}

/// Returns the process that has the given rank, among the children of `mpirun`.
fn process_of(mpirun: &Child, rank: usize) -> Option<u32> {
    let wanted = format!("OMPI_COMM_WORLD_RANK={rank}");
    let children = format!("/proc/{0}/task/{0}/children", mpirun.id());
    let children = fs::read_to_string(children).unwrap_or_default();
    children.split_whitespace().filter_map(|id| id.parse().ok()).find(|id: &u32| {
        let environment = fs::read(format!("/proc/{id}/environ")).unwrap_or_default();
        environment.split(|&byte| byte == 0).any(|entry| entry == wanted.as_bytes())
    })
}

/// Returns whether a process exists and is not a zombie.
fn lives(process: u32) -> bool {
    let state = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // The name of the program is in parentheses and may contain spaces.
    let after_name = state.rsplit(')').next().unwrap_or_default();
    after_name.split_whitespace().next().is_some_and(|state| state != "Z")
}

#[test]
fn a_killed_rank_ends_all_and_the_last_checkpoint_is_whole() {
    let folder = folder(&[("rtol = 1e-7", "rtol = 1e-9"), ("max_steps = 50\n", "")]);
    let folder = folder.path();
    let arguments = ["-n", "3", PROGRAM, "run", "scene.toml", "--quiet"];
    let mut started =
        mpirun(folder, &arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let checkpoint = folder.join("out/checkpoint.json");
    while !checkpoint.exists() && started.try_wait().unwrap().is_none() {
        thread::yield_now();
    }
    let ranks = [0, 1, 2].map(|rank| process_of(&started, rank).expect("a run in its midst"));
    let killed = Command::new("kill").args(["-KILL", &ranks[2].to_string()]).status();
    assert!(killed.unwrap().success());
    let Output { status, stderr, .. } = started.wait_with_output().unwrap();
    let reported = String::from_utf8(stderr).unwrap();
    assert!(!status.success() && reported.contains("rank 2"), "{reported}");
    for process in ranks {
        let killed = Instant::now();
        while lives(process) {
            assert!(killed.elapsed() < Duration::from_secs(20), "{process} lives");
            thread::yield_now();
        }
    }
    assert!(!folder.join("out/run.json").exists());
    let t = json(checkpoint)["checkpoint"]["t"].as_f64().unwrap();
    assert!(0.0 < t && t < 0.3, "{t}");
    // The run can be resumed with any number of ranks.
    let resumed = mpirun(folder, &["-n", "2", PROGRAM, "run", "scene.toml", "--quiet", "--resume"])
        .output()
        .unwrap();
    assert!(resumed.status.success(), "{}", String::from_utf8_lossy(&resumed.stderr));
    let document = json(folder.join("out/run.json"));
    assert_eq!(document["outcome"], "finished");
    assert!(document["resumed"].as_u64() == Some(1), "{}", document["resumed"]);
}

/// Checks that ranks are rejected if they read different bodies: the file has the same name in both folders.
#[test]
fn ranks_that_read_other_bodies_are_refused() {
    let (here, there) = (folder(&[]), folder(&[("[10, 2, 2]", "[20, 2, 2]")]));
    let nowhere = tempfile::tempdir().unwrap();
    for (other, reason) in [(&there, ""), (&nowhere, "scene.toml")] {
        let [first, second] = [&here, other].map(|folder| folder.path().to_str().unwrap());
        let of_one = |folder| ["-n", "1", "--wdir", folder, PROGRAM, "run", "scene.toml"];
        let arguments = [&of_one(first)[..], &[":"], &of_one(second)].concat();
        let Output { status, stderr, .. } = mpirun(here.path(), &arguments).output().unwrap();
        let reported = String::from_utf8(stderr).unwrap();
        assert_eq!(status.code(), Some(2), "{reported}");
        let message = "error: rank 1 does not load the same body as rank 0";
        assert!(reported.contains(message) && reported.contains(reason), "{reported}");
        assert!(!here.path().join("out").exists(), "nothing is written");
    }
}

#[test]
fn a_wrong_command_is_reported_once() {
    let folder = folder(&[]);
    let wrong = mpirun(folder.path(), &["-n", "2", PROGRAM, "run", "--nonsense"]).output().unwrap();
    let reported = String::from_utf8(wrong.stderr).unwrap();
    assert_eq!(wrong.status.code(), Some(2), "{reported}");
    assert_eq!(reported.matches("error: unexpected").count(), 1, "{reported}");
}

//! Tests of runs killed at each change of a file and then resumed. The folder must equal the folder of an uninterrupted
//! run, except for times, memory and the number of resumes.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use myovib_model::{EndReason, Outcome};
use serde_json::Value;

use super::checkpoint::LARGEST_COUNT;
use super::{Existing, RunOptions, compute};
use crate::Scene;
use crate::atomic_file::faults::with_disk_that_stops_after;
use crate::atomic_file::passing;
use crate::result_folder::FolderRequest;
use crate::watch::ProgressSink;

/// Scene with a body in an index-1 formulation, a table, an energy balance, fields and two checkpoints.
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
[checkpoint]
interval = 0.008
[fields]
interval = 0.01
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.01]
interval = 0.005
[[probe]]
name = "energy"
type = "energy"
interval = 0.01
"#;

fn scene() -> Scene {
    Scene::build("scene.toml", SCENE, &[], Path::new("")).unwrap()
}

fn options(out: &Path, existing: Existing, verify: bool) -> RunOptions<'static> {
    RunOptions { existing, verify, ..RunOptions::into_folder(out) }
}

/// Returns the names and contents of the files in a folder. Times, memory and the number of resumes are removed from
/// `run.json`; the number of resumes and the checksum are removed from the checkpoint.
fn files(folder: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: BTreeMap<String, String> = entries
        .map(|entry| {
            let text = fs::read_to_string(entry.path()).unwrap();
            (entry.file_name().into_string().unwrap(), text)
        })
        .collect();
    if let Some(text) = files.get_mut("run.json") {
        let mut document: Value = serde_json::from_str(text).unwrap();
        let keys =
            ["cpu_seconds", "wall_seconds", "wall_seconds_by_part", "peak_memory_bytes", "resumed"];
        for key in keys {
            remove(&mut document, key);
        }
        *text = document.to_string();
    }
    if let Some(text) = files.get_mut("checkpoint.json") {
        let mut document: Value = serde_json::from_str(text).unwrap();
        remove(&mut document, "sha256");
        remove(&mut document["checkpoint"]["counts"], "resumed");
        *text = document.to_string();
    }
    files
}

fn remove(object: &mut Value, key: &str) {
    let removed = object.as_object_mut().unwrap().remove(key);
    assert!(removed.is_some(), "{key}");
}

/// Kills a run after `last` file changes, and then resumes it to its end.
fn killed_and_completed(out: &Path, last: u64, torn: bool, verify: bool) {
    let scene = scene();
    let run = |existing| passing(|| compute(&scene, &options(out, existing, verify)));
    let _ = with_disk_that_stops_after(last, torn, || run(Existing::Refuse));
    let resumed = run(Existing::Resume).map(drop);
    assert!(resumed.is_ok(), "change {last}, torn: {torn}, verify: {verify}: {resumed:?}");
}

fn assert_killed_runs_are_completed(verify: bool, stride: usize) {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    let scene = scene();
    let uninterrupted = || compute(&scene, &options(&whole, Existing::Refuse, verify)).unwrap();
    let (_, changes) = with_disk_that_stops_after(u64::MAX, false, uninterrupted);
    assert!(changes > 60, "{changes}");
    let expected = files(&whole);
    for last in (0..changes).step_by(stride) {
        for torn in [false, true] {
            let out = folder.path().join(format!("{last}-{torn}"));
            killed_and_completed(&out, last, torn, verify);
            let found = files(&out);
            assert!(found.keys().eq(expected.keys()), "{last}: {:?}", found.keys());
            for (name, text) in &expected {
                assert!(found[name] == *text, "{name} after change {last}, torn: {torn}");
            }
        }
    }
}

/// Regression: a run that was killed after its last checkpoint could not be completed.
#[test]
fn a_run_that_is_killed_at_any_change_of_a_file_is_completed() {
    assert_killed_runs_are_completed(false, 1);
}

#[test]
fn a_verified_run_that_is_killed_at_any_change_of_a_file_is_completed() {
    assert_killed_runs_are_completed(true, 1);
}

/// Regression: the second run wrote the fields of all times to a temporary folder, although only its tables are used.
#[test]
fn a_verification_writes_no_fields() {
    let folder = tempfile::tempdir().unwrap();
    let changes = |interval: &str, verify: bool| {
        let fields = format!("[fields]\ninterval = {interval}");
        let text = SCENE.replace("[fields]\ninterval = 0.01", &fields);
        let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
        let out = folder.path().join(format!("{interval}-{verify}"));
        let run = || compute(&scene, &options(&out, Existing::Refuse, verify)).unwrap();
        with_disk_that_stops_after(u64::MAX, false, run).1
    };
    let [few, many] =
        ["0.01", "0.001"].map(|interval| [false, true].map(|verify| changes(interval, verify)));
    // With the shorter interval, a run writes 21 fields instead of 3.
    assert!(many[0] >= few[0] + 18, "{few:?} {many:?}");
    assert_eq!(many[1] - many[0], few[1] - few[0], "{few:?} {many:?}");
}

/// Regression: an interrupted `--verify` reported errors of zero and ended with success.
#[test]
fn an_interrupted_verification_measures_no_error_and_is_repeated() {
    static INTERRUPT: AtomicBool = AtomicBool::new(false);
    /// Interrupts the second run, which starts after the first has written its `run.json`.
    struct SecondRun<'a>(&'a Path);
    impl ProgressSink for SecondRun<'_> {
        fn on_progress(&self, _: &dyn Fn() -> String) {
            INTERRUPT.store(self.0.join("run.json").exists(), Relaxed);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let scene = scene();
    let run = |existing, progress| {
        let options = options(&out, existing, true);
        let options = RunOptions { interrupt: Some(&INTERRUPT), progress, ..options };
        passing(|| compute(&scene, &options)).unwrap()
    };
    let second_run = SecondRun(&out);
    let interrupted = run(Existing::Refuse, &second_run);
    assert!(INTERRUPT.load(Relaxed));
    assert_eq!(interrupted.outcome.reason(), Some(EndReason::Interrupted));
    assert_eq!(interrupted.document["outcome"], "finished");
    assert!(interrupted.document["error_estimate"].is_null());
    INTERRUPT.store(false, Relaxed);
    let resumed = run(Existing::Resume, &());
    assert_eq!(resumed.outcome, Outcome::Finished);
    assert!(resumed.document["error_estimate"]["probes"]["tip"]["p"]["error"].as_f64() > Some(0.0));
}

/// Regression: a checkpoint of another method was used, and damaged checkpoints panicked.
#[test]
fn a_damaged_or_foreign_checkpoint_is_refused_before_anything_is_used() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let scene = scene();
    compute(&scene, &options(&out, Existing::Refuse, false)).unwrap();
    let path = out.join("checkpoint.json");
    let good = fs::read_to_string(&path).unwrap();
    let tables = || fs::read_to_string(out.join("tip.csv")).unwrap();
    let rows = tables();
    let refused = |text: &str, place: &str| {
        fs::write(&path, text).unwrap();
        let resumed = compute(&scene, &options(&out, Existing::Resume, false));
        let error = resumed.map(drop).unwrap_err();
        assert!(matches!(error, crate::Error::Input(_)), "{place}: {error}");
        assert_eq!(tables(), rows, "{place}");
    };
    for cut in [0, 1, 50, good.len() / 2, good.len() - 2] {
        refused(&good[..cut], &format!("cut after {cut}"));
    }
    // One digit is changed at various positions in the file.
    for start in (0..good.len()).step_by(good.len() / 40) {
        let digit = good[start..].find(|c: char| c.is_ascii_digit());
        let Some(at) = digit.map(|at| start + at) else {
            continue;
        };
        let other = if good[at..].starts_with('7') { "3" } else { "7" };
        let changed = format!("{}{other}{}", &good[..at], &good[at + 1..]);
        refused(&changed, &format!("changed at {at}"));
    }
    // This checkpoint belongs to another method for the same body and times.
    let other = SCENE.replace("\"radau5\"", "\"radau9\"");
    let other = Scene::build("scene.toml", &other, &[], Path::new("")).unwrap();
    let foreign = folder.path().join("foreign");
    compute(&other, &options(&foreign, Existing::Refuse, false)).unwrap();
    refused(&fs::read_to_string(foreign.join("checkpoint.json")).unwrap(), "foreign");
    fs::write(&path, &good).unwrap();
    compute(&scene, &options(&out, Existing::Resume, false)).unwrap();
}

/// Calls `visit` with the path of each value of a document.
fn visit_values(json: &Value, path: &str, visit: &mut impl FnMut(&str, &Value)) {
    visit(path, json);
    match json {
        Value::Array(all) => {
            for (k, own) in all.iter().enumerate() {
                visit_values(own, &format!("{path}/{k}"), visit);
            }
        }
        Value::Object(all) => {
            for (key, own) in all {
                visit_values(own, &format!("{path}/{key}"), visit);
            }
        }
        _ => {}
    }
}

/// Regression: sums of counters from a forged checkpoint overflowed. The test changes each counter and removes the last
/// value of each list, with a valid checksum.
#[test]
fn forged_checkpoints_do_not_panic() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let scene = scene();
    compute(&scene, &options(&out, Existing::Refuse, false)).unwrap();
    let path = out.join("checkpoint.json");
    let good = fs::read_to_string(&path).unwrap();
    let body: Value = serde_json::from_str::<Value>(&good).unwrap()["checkpoint"].take();
    let [mut counters, mut lists] = [Vec::new(), Vec::new()];
    visit_values(&body, "", &mut |path, value| match value {
        Value::Number(number) if number.is_u64() => counters.push(path.to_owned()),
        Value::Array(all) if !all.is_empty() => lists.push(path.to_owned()),
        _ => {}
    });
    assert!(counters.len() > 30 && lists.len() > 10, "{counters:?} {lists:?}");
    let resumed = |pointer: &str, change: &dyn Fn(&mut Value)| {
        let mut forged = body.clone();
        change(forged.pointer_mut(pointer).unwrap());
        let text = forged.to_string();
        let mut head: Value = serde_json::from_str(&good).unwrap();
        head.as_object_mut().unwrap().remove("checkpoint");
        head["sha256"] = crate::inputs::sha256(text.as_bytes()).into();
        let head = head.to_string();
        fs::write(&path, format!("{},\"checkpoint\":{text}}}\n", head.trim_end_matches('}')))
            .unwrap();
        compute(&scene, &options(&out, Existing::Resume, false))
    };
    for counter in &counters {
        for forged in [0, LARGEST_COUNT, u64::MAX] {
            let result = resumed(counter, &|value| *value = forged.into());
            let error = result.map(drop);
            let is_possible = forged <= LARGEST_COUNT && error.is_ok();
            let is_refused = matches!(error, Err(crate::Error::Input(_)));
            assert!(is_possible || is_refused, "{counter} {forged}: {error:?}");
        }
    }
    for list in &lists {
        let result = resumed(list, &|value| drop(value.as_array_mut().unwrap().pop()));
        let error = result.map(drop);
        assert!(matches!(error, Ok(()) | Err(crate::Error::Input(_))), "{list}: {error:?}");
    }
}

/// Checks that the folder request of a run lists the files before the run creates them.
#[test]
fn a_run_lists_all_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    compute(&scene(), &options(&out, Existing::Refuse, false)).unwrap();
    let own = [".lock", "manifest.jsonl"];
    let made = files(&out).into_keys();
    let made: Vec<String> = made.filter(|name| !own.contains(&name.as_str())).collect();
    FolderRequest::to_add(&out, "run", made.clone()).check().unwrap();
    assert!(made.len() > 6, "{made:?}");
}

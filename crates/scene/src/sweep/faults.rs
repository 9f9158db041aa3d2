//! Tests of sweeps that are killed while they recompute cases. The next sweep must compute these cases and remove
//! temporary files.

use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;

use super::{Cases, SweepOptions, compute};
use crate::atomic_file::faults::with_disk_that_stops_after;
use crate::atomic_file::passing;
use crate::run::faults::SCENE;

fn sweep(folder: &Path, out: &Path, overwrite: bool) -> Result<(), crate::Error> {
    let scene = folder.join("scene.toml");
    let text = SCENE.replace("[fields]\ninterval = 0.01\n", "");
    fs::write(&scene, text).unwrap();
    let options = SweepOptions {
        scene,
        vary: vec!["material[0].shear_modulus=1e4,2e4".to_owned()],
        results: Vec::new(),
        set: Vec::new(),
        out: out.to_owned(),
        cases: Cases::All,
        overwrite,
        from_neighbor: false,
        n_threads: NonZeroUsize::MIN,
        interrupt: None,
        progress: &(),
        finished: &|_, _, _| Ok(()),
    };
    passing(|| compute(&options)).map(drop)
}

/// Returns the names of all files. For tables, also returns the text.
fn files(folder: &Path) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            let own = files(&path).into_iter();
            all.extend(own.map(|(inner, text)| (format!("{name}/{inner}"), text)));
        } else {
            let is_table = name == "tip.csv";
            let text = is_table.then(|| fs::read_to_string(&path).unwrap());
            all.insert(name, text.unwrap_or_default());
        }
    }
    all
}

/// Regression: a case whose recomputation was killed counted as done, and its temporary file remained.
#[test]
fn a_sweep_killed_while_it_replaces_results_is_completed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    sweep(folder.path(), &out, false).unwrap();
    let expected = files(&out);
    let again = || sweep(folder.path(), &out, true);
    let (done, changes) = with_disk_that_stops_after(u64::MAX, false, again);
    done.unwrap();
    assert!(changes > 50, "{changes}");
    for last in (0..changes).step_by(5) {
        for torn in [false, true] {
            // The failure of the case is recorded only in memory because the disk no longer accepts changes.
            let _ = with_disk_that_stops_after(last, torn, again);
            sweep(folder.path(), &out, false).unwrap();
            assert_eq!(files(&out), expected, "change {last}, torn: {torn}");
        }
    }
}

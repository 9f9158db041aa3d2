//! Sweeps as a library runs them.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use myovib_scene::run::RunResult;
use myovib_scene::sweep::{Cases, SweepOptions, compute};
use myovib_scene::{Error, Scene};

/// Issue 15, D3: a mistake of the program in one case ended the sweep.
#[test]
fn a_panic_in_one_case_is_a_row_and_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let finished = AtomicUsize::new(0);
    let sweep = |after_case: &(dyn Fn(&Path, &Scene, &RunResult) -> Result<(), Error> + Sync)| {
        let result = compute(&SweepOptions {
            scene: "cook-static".into(),
            vary: vec!["solid.kappa=1e5,2e5,4e5".to_owned()],
            results: Vec::new(),
            set: vec!["mesh.cells=[2,2]".to_owned()],
            out: folder.path().to_owned(),
            cases: Cases::All,
            overwrite: false,
            n_threads: NonZeroUsize::new(2).unwrap(),
            interrupt: None,
            progress: &(),
            finished: after_case,
        });
        let document = result.unwrap().document;
        [0, 1, 2].map(|case| {
            let row = &document["rows"][case];
            let word = |key: &str| row[key].as_str().unwrap_or_default().to_owned();
            (word("outcome"), word("message"))
        })
    };
    let count = |_: &Path, _: &Scene, _: &RunResult| {
        finished.fetch_add(1, Ordering::Relaxed);
        Ok(())
    };
    let rows = sweep(&|folder, scene, result| {
        assert!(!folder.ends_with("case-0002"), "one case meets a mistake");
        count(folder, scene, result)
    });
    assert_eq!((&*rows[0].0, &*rows[2].0), ("finished", "finished"));
    assert_eq!(rows[1].0, "failed");
    let said = "a mistake in the program: one case meets a mistake";
    assert!(rows[1].1.contains(said), "{}", rows[1].1);
    assert_eq!(finished.swap(0, Ordering::Relaxed), 2);
    // The others are done; only what failed is computed.
    let rows = sweep(&count);
    assert!(rows.iter().all(|(outcome, _)| outcome == "finished"));
    assert_eq!(finished.into_inner(), 1);
}

/// Regression: what `--vary` gave was told as `--set`.
#[test]
fn a_wrong_value_is_told_with_its_option() {
    let folder = tempfile::tempdir().unwrap();
    let said = |vary: &str, set: &str| {
        let result = compute(&SweepOptions {
            scene: "cook-static".into(),
            vary: vec![vary.to_owned()],
            results: Vec::new(),
            set: vec![set.to_owned()],
            out: folder.path().join("out"),
            cases: Cases::All,
            overwrite: false,
            n_threads: NonZeroUsize::MIN,
            interrupt: None,
            progress: &(),
            finished: &|_: &Path, _: &Scene, _: &RunResult| Ok(()),
        });
        result.map(|_| ()).unwrap_err().to_string()
    };
    let of_vary = said("solid.kapa=1,2", "mesh.cells=[2,2]");
    assert!(of_vary.contains("where: --vary solid.kapa=1"), "{of_vary}");
    let of_set = said("solid.kappa=1,2", "mesh.cels=[2,2]");
    assert!(of_set.contains("where: --set mesh.cels"), "{of_set}");
}

//! Sweeps run through the library.

use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use myovib_scene::run::RunResult;
use myovib_scene::sweep::{Cases, SweepOptions, compute};
use myovib_scene::{Error, Scene};
use serde_json::Value;

/// Returns options of a sweep with one case at a time.
fn options(scene: impl AsRef<Path>, vary: &[&str], out: &Path) -> SweepOptions<'static> {
    SweepOptions {
        scene: scene.as_ref().to_owned(),
        vary: vary.iter().map(|&vary| vary.to_owned()).collect(),
        results: Vec::new(),
        set: Vec::new(),
        out: out.to_owned(),
        cases: Cases::All,
        overwrite: false,
        from_neighbor: false,
        n_threads: NonZeroUsize::MIN,
        interrupt: None,
        progress: &(),
        finished: &|_: &Path, _: &Scene, _: &RunResult| Ok(()),
    }
}

/// Regression: a panic in one case ended the sweep.
#[test]
fn a_panic_in_one_case_is_a_row_and_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let finished = AtomicUsize::new(0);
    let sweep = |after_case: &(dyn Fn(&Path, &Scene, &RunResult) -> Result<(), Error> + Sync)| {
        let result = compute(&SweepOptions {
            set: vec!["mesh.cells=[2,2]".to_owned()],
            n_threads: NonZeroUsize::new(2).unwrap(),
            finished: after_case,
            ..options("cook-static", &["solid.bulk_modulus=1e5,2e5,4e5"], folder.path())
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
    let printed = "internal error (bug): one case meets a mistake";
    assert!(rows[1].1.contains(printed), "{}", rows[1].1);
    assert_eq!(finished.swap(0, Ordering::Relaxed), 2);
    // The other cases are done; only the failed case is computed.
    let rows = sweep(&count);
    assert!(rows.iter().all(|(outcome, _)| outcome == "finished"));
    assert_eq!(finished.into_inner(), 1);
}

/// Returns the error of a rejected sweep of `scene`.
fn refusal(out: &Path, scene: &str, vary: &[&str], set: &str, cases: Cases) -> Option<String> {
    let result =
        compute(&SweepOptions { set: vec![set.to_owned()], cases, ..options(scene, vary, out) });
    result.err().map(|error| error.to_string())
}

/// Regression: an error in a value of `--vary` was reported for `--set`.
#[test]
fn a_wrong_value_is_reported_with_its_option() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let printed =
        |vary: &str, set: &str| refusal(&out, "cook-static", &[vary], set, Cases::All).unwrap();
    let of_vary = printed("solid.kapa=1,2", "mesh.cells=[2,2]");
    assert!(of_vary.contains("solid.kapa=1"), "{of_vary}");
    let of_set = printed("solid.bulk_modulus=1,2", "mesh.cels=[2,2]");
    assert!(of_set.contains("mesh.cels"), "{of_set}");
}

/// Regression: an invalid value after the first of its key was detected only when its case was run.
#[test]
fn all_cases_are_read_before_one_is_computed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let wrong = ["solid.bulk_modulus=1e5,2e5", "material[0].density=1,-1"];
    let printed = |cases| refusal(&out, "cook-static", &wrong, "mesh.cells=[2,2]", cases);
    let first = printed(Cases::All).unwrap();
    let case = "case: 2: solid.bulk_modulus=1e5, material[0].density=-1";
    assert!(first.contains(case), "{first}");
    // The value is readable, but the run rejects it, because the probe is beyond the rod.
    let beyond = ["probe[1].at=0.05,9.0"];
    let beyond = refusal(&out, "figure3", &beyond, "time.end=0.01", Cases::All).unwrap();
    assert!(beyond.contains("2: probe[1].at=9.0"), "{beyond}");
    assert!(!out.exists(), "nothing is written");

    // Unselected cases are not read.
    let some = |cases: &str| printed(Cases::Some(cases.to_owned()));
    assert_eq!(some("1/4"), None);
    assert!(some("1-2/4").is_some_and(|printed| printed.contains("case: 2: ")));
    // The first case is not read either unless selected. Its error is reported as for any other
    // case.
    let first = |cases: &str| {
        let (wrong, cases) = (["material[0].density=-1,1"], Cases::Some(cases.to_owned()));
        let out = folder.path().join("other");
        refusal(&out, "cook-static", &wrong, "mesh.cells=[2,2]", cases)
    };
    assert_eq!(first("2/2"), None);
    assert!(first("1/2").is_some_and(|printed| printed.contains("case: 1: ")));
}

/// Regression: the check before a sweep started bodies with chains, and rejected cases without
/// equilibrium. For bodies without chains, it did not check the loads.
#[test]
fn loads_on_a_body_at_rest_are_rejected_without_searching_an_equilibrium() {
    let folder = tempfile::tempdir().unwrap();
    for (name, set) in
        [("alone", "title=alone"), ("chains", "chain=[{ name = \"c\", oscillators = 2 }]")]
    {
        let out = folder.path().join(name);
        let printed = |vary: &[&str]| refusal(&out, "init", vary, set, Cases::All);
        let sudden = printed(&["time.end=0.01", "traction[0].y=0.0,100.0"]).unwrap();
        for words in ["do not start from zero", "case: 2: time.end=0.01"] {
            assert!(sudden.contains(words), "{name}: {sudden}");
        }
        assert!(!out.exists(), "{name}: nothing is written");

        // The body is not supported along y.
        let free = [
            "time.end=0.01",
            "initial_state={ type = \"equilibrium\" }",
            "fixed[0].components=[\"x\"]",
        ];
        assert_eq!(printed(&free), None, "{name}");
        let table = std::fs::read_to_string(out.join("sweep.csv")).unwrap();
        assert!(table.contains("failed"), "{name}: {table}");
    }
}

/// Regression: a second process removed the record of a case, and computed the case again, before the first had
/// recorded it.
#[test]
fn a_case_is_computed_and_recorded_by_one_process() {
    let folder = tempfile::tempdir().unwrap();
    let computed = AtomicUsize::new(0);
    type Finished<'a> = &'a (dyn Fn(&Path, &Scene, &RunResult) -> Result<(), Error> + Sync);
    let sweep = |finished: Finished<'_>| {
        let result = compute(&SweepOptions {
            set: vec!["mesh.cells=[2,2]".to_owned()],
            finished,
            ..options("cook-static", &["solid.bulk_modulus=1e5"], folder.path())
        });
        assert_eq!(result.unwrap().document["rows"][0]["outcome"], "finished");
    };
    let count = |_: &Path, _: &Scene, _: &RunResult| {
        computed.fetch_add(1, Ordering::Relaxed);
        Ok(())
    };
    std::thread::scope(|scope| {
        sweep(&|folder, scene, result| {
            // Locks belong to open files, so a second sweep of this process counts as another process.
            let second = scope.spawn(|| sweep(&count));
            // Without the lock, the second sweep ends after about 20 ms.
            std::thread::sleep(std::time::Duration::from_millis(300));
            assert!(!second.is_finished());
            count(folder, scene, result)
        });
    });
    assert_eq!(computed.into_inner(), 1);
}

const COLUMN: &str = r#"analysis = "static"
[mesh]
type = "rectangle"
width = 0.1
height = 0.01
cells = [10, 2]
[solid]
bulk_modulus = 1e6
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 1e4
[[fixed]]
group = "left"
[[traction]]
group = "right"
x = 0.0
y = 0.0
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.005]
"#;

/// Computes a sweep of the column. Returns the deflection of its tip, the number of iterations, and whether the case was
/// continued, for each case.
fn deflections(text: &str, vary: &[&str], from_neighbor: bool) -> Vec<(f64, f64, bool)> {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, text).unwrap();
    let out = folder.path().join("out");
    let result = compute(&SweepOptions {
        results: vec!["tip=last(tip.u_y)".to_owned()],
        from_neighbor,
        n_threads: NonZeroUsize::new(2).unwrap(),
        ..options(scene, vary, &out)
    });
    let document = result.unwrap().document;
    let rows = document["rows"].as_array().unwrap().iter();
    rows.map(|row| {
        let case = out.join(format!("case-{:04}", row["case"].as_u64().unwrap()));
        let run = fs::read_to_string(case.join("run.json")).unwrap();
        let run: Value = serde_json::from_str(&run).unwrap();
        let number = |key: &str| row[key].as_f64().unwrap();
        (number("tip"), number("newton_iterations"), run["is_continued"] == true)
    })
    .collect()
}

/// Checks equilibria from two different starts. In both cases, Newton's method ends with an increment below 1e-9 of the
/// solution.
#[test]
fn cases_continued_from_their_neighbors_have_the_same_equilibria_with_fewer_iterations() {
    for vary in [
        ["solid.bulk_modulus=1e5,inf", "traction[0].y=20.0,30.0,40.0"],
        ["traction[0].y=-20.0,20.0", "material[0].shear_modulus=1e4,1.2e4,1.5e4"],
        ["material[0].shear_modulus=1e4,2e4", "prescribed_displacement[0].y=0.02,0.03,0.04"],
    ] {
        let moved = "[[prescribed_displacement]]\ngroup = \"right\"\ny = 0.0\n";
        let text = match vary[1].starts_with("prescribed") {
            true => format!("{COLUMN}{moved}")
                .replace("x = 0.0\ny = 0.0\n[[probe]]", "x = 0.0\n[[probe]]"),
            false => COLUMN.to_owned(),
        };
        let [rest, continued] = [false, true].map(|from| deflections(&text, &vary, from));
        let mut iterations = [0.0; 2];
        for (k, (rest, continued)) in rest.iter().zip(&continued).enumerate() {
            assert!((continued.0 / rest.0 - 1.0).abs() < 1e-9, "{vary:?} {k}");
            assert_eq!((rest.2, continued.2), (false, k % 3 != 0), "{vary:?} {k}");
            if continued.2 {
                iterations[0] += rest.1;
                iterations[1] += continued.1;
            }
        }
        assert!(iterations[1] < iterations[0], "{vary:?} {iterations:?}");
    }
}

/// Checks a column that is loaded above its buckling load, 82 Pa. It buckles to the side of a small transverse load,
/// and stays there if this load is reversed, although the unloaded column would buckle to the other side.
#[test]
fn a_buckled_column_stays_on_its_branch() {
    let text = COLUMN.replace("x = 0.0\n", "x = -95.0\n");
    let vary = ["traction[0].y=1.0,0.2,-0.2"];
    let [rest, continued] = [false, true].map(|from| deflections(&text, &vary, from));
    assert!(rest[1].0 > 0.0 && rest[2].0 < 0.0, "{rest:?}");
    assert!(continued[2].2 && continued[2].0 > 0.9 * continued[1].0, "{continued:?}");
}

/// Checks that a case whose mesh differs from its neighbor's mesh starts from the unloaded body.
#[test]
fn a_case_without_a_neighboring_equilibrium_starts_from_rest() {
    let vary = ["mesh.cells=[10,2],[12,2]"];
    let [rest, continued] =
        [false, true].map(|from| deflections(&COLUMN.replace("y = 0.0", "y = 20.0"), &vary, from));
    assert_eq!(rest, continued);
}

/// Checks that a motion starts from its initial state, and a loading path from the unloaded body.
#[test]
fn scenes_of_several_states_do_not_start_from_a_neighbor() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let refused = |text: &str| {
        fs::write(&scene, text).unwrap();
        let result = compute(&SweepOptions {
            from_neighbor: true,
            ..options(&scene, &["traction[0].y=1.0,2.0"], &folder.path().join("out"))
        });
        result.unwrap_err().to_string()
    };
    let path = format!("{COLUMN}[static]\nsteps = 4\n");
    let modes = COLUMN.replace("\"static\"", "\"modes\"");
    let motion = COLUMN.replace("analysis = \"static\"", "time.end = 0.1");
    for text in [path, modes, motion] {
        assert!(refused(&text).contains("--from-neighbor"), "{text}");
    }
    assert!(!folder.path().join("out").exists());
}

/// Regression: cases that left their branch and columns without a value were not reported. An override of a varied key was
/// ignored. A shortened table was read as the result of its case.
#[test]
fn a_sweep_reports_what_its_table_does_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, COLUMN.replace("y = 0.0", "y = 20.0")).unwrap();
    let out = folder.path().join("out");
    let sweep = |set: &[&str]| {
        compute(&SweepOptions {
            results: ["tip=last(tip.u_y)", "late=last(tip.u_y, 9)", "root=sqrt(0-last(tip.u_y))"]
                .map(str::to_owned)
                .to_vec(),
            set: set.iter().map(|&set| set.to_owned()).collect(),
            from_neighbor: true,
            ..options(&scene, &["mesh.cells=[10,2],[12,2]"], &out)
        })
    };
    let varied = sweep(&["mesh.cells=[4,2]"]).unwrap_err().to_string();
    assert!(varied.contains("mesh.cells=[4,2]"), "{varied}");
    assert!(!out.exists());
    let first = sweep(&[]).unwrap();
    let has_note = |of: &str| first.notes.iter().any(|note| note.contains(of));
    assert!(has_note("case 2") && has_note("late") && has_note("root"), "{:?}", first.notes);
    assert_eq!(first.notes.len(), 3);
    let tip = out.join("case-0002/tip.csv");
    let whole = fs::read_to_string(&tip).unwrap();
    fs::write(&tip, "t,u_x,u_y\n0,0,0\n").unwrap();
    assert_eq!(sweep(&[]).unwrap().csv.lines().count(), first.csv.lines().count());
    assert_eq!(fs::read_to_string(&tip).unwrap(), whole);
}

//! Curves of periodic states over a parameter.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use myovib_model::EndReason;
use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::periodic::Periodic;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::watch::ProgressSink;

use crate::fields::expect_kept;

/// A strip between two clamps, which becomes stiffer when it is deflected.
const STRIP: &str = "analysis = \"periodic\"\n[mesh]\ntype = \"rectangle\"\nwidth = 0.05\nheight = 0.002\ncells = [2, 1]\n\
     [solid]\nbulk_modulus = 1e5\nformulation = \"displacement\"\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
     shear_modulus = 2e4\nviscosity = 10.0\n[[fixed]]\ngroup = \"left\"\n[[fixed]]\ngroup = \"right\"\n[[traction]]\n\
     group = \"bottom\"\ny = { type = \"sine\", amplitude = 30.0, frequency = 29.0 }\n[periodic]\ntolerance = 1e-4\n\
     multipliers = 1\nsamples = 32\n[[probe]]\nname = \"middle\"\ntype = \"point\"\nat = [0.025, 0.001]\n\
     quantities = [\"u\"]\n";

fn built(set: &[&str]) -> Result<Scene, String> {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::build("scene.toml", STRIP, &set, Path::new("")).map_err(|error| error.to_string())
}

fn found(set: &[&str], folder: &Path) -> Periodic {
    let result = compute(&built(set).unwrap(), &RunOptions::into_folder(folder)).unwrap();
    result.periodic.unwrap()
}

fn amplitude(found: &Periodic) -> f64 {
    let columns = &found.probes[0].columns;
    let u_y = columns.iter().find(|column| column.name == "u_y").unwrap();
    u_y.amplitudes[0]
}

/// Checks that the curve passes both folds. Beyond them there is a single state, which shooting also finds without
/// following the curve.
#[test]
fn the_resonance_curve_of_a_strip_passes_its_folds() {
    let out = tempfile::tempdir().unwrap();
    let continuation = [
        "periodic.continuation.parameter=\"traction[0].y.frequency\"",
        "periodic.continuation.to=36.0",
        "periodic.continuation.max_step=0.5",
    ];
    let curve = found(&continuation, out.path()).continuation.unwrap();
    assert_eq!(curve.incomplete, None);
    let folds: Vec<f64> =
        curve.points.iter().filter(|point| point.is_fold).map(|point| point.parameter).collect();
    assert_eq!(folds.len(), 2, "{folds:?}");
    // The upper branch ends at the higher fold, the lower branch at the lower fold. Between them the states are unstable.
    assert!(folds[0] > folds[1]);
    let mut n_folds = 0;
    for point in &curve.points {
        match point.is_fold {
            true => n_folds += 1,
            false => assert_eq!(point.is_stable, Some(n_folds != 1), "{point:?}"),
        }
        assert_eq!(point.frequency, point.parameter);
    }
    let last = curve.points.last().unwrap();
    assert_eq!(last.parameter, 36.0);
    let u_y = curve.columns.iter().position(|name| name == "middle.u_y").unwrap();
    let frequency = format!("traction[0].y.frequency={:?}", last.parameter);
    let alone = found(&[&frequency], tempfile::tempdir().unwrap().path());
    let expected = amplitude(&alone);
    // Both states have a tolerance of 1e-4 of the motion.
    assert!((last.amplitudes[u_y] - expected).abs() < 1e-3 * expected);
    let table = std::fs::read_to_string(out.path().join("continuation.csv")).unwrap();
    assert_eq!(Table::parse(&table).unwrap().rows.len(), curve.points.len());
}

#[test]
fn invalid_curves_are_refused_at_their_key() {
    for (key, to, place) in [
        ("traction[0].y.frequenzy", "9.0", "periodic.continuation.parameter"),
        ("traction[0].y.frequency", "29.0", "periodic.continuation.to"),
        ("traction[0].y.frequency", "-1.0", "frequency"),
        ("mesh.width", "0.06", "periodic.continuation.parameter"),
        ("mesh.cells[0]", "4.0", "mesh"),
        ("group[0].min[0]", "0.1", "periodic.continuation.parameter"),
    ] {
        let set = [
            &*format!("periodic.continuation.parameter={key:?}"),
            &*format!("periodic.continuation.to={to}"),
        ];
        let out = tempfile::tempdir().unwrap();
        let scene = built(&set).unwrap();
        let error = compute(&scene, &RunOptions::into_folder(out.path())).unwrap_err();
        assert!(matches!(error, myovib_scene::Error::Input(_)), "{error}");
        assert!(error.to_string().contains(place), "{error}");
    }
}

/// Regression: the table of the curve replaced the table of the probe.
#[test]
fn no_probe_has_the_name_of_the_curve() {
    let set = [
        "periodic.continuation.parameter=\"traction[0].y.frequency\"",
        "periodic.continuation.to=30.0",
        "probe[0].name=\"continuation\"",
    ];
    let out = tempfile::tempdir().unwrap();
    let error = compute(&built(&set).unwrap(), &RunOptions::into_folder(out.path().join("out")));
    assert!(matches!(error.unwrap_err(), myovib_scene::Error::Input(_)));
    assert!(!out.path().join("out").exists());
}

/// Regression: a file of the user was found only after the computation, and tables had already been written.
#[test]
fn a_table_of_the_user_is_found_before_anything_is_written() {
    let set = [
        "periodic.continuation.parameter=\"traction[0].y.frequency\"",
        "periodic.continuation.to=29.1",
    ];
    expect_kept(&built(&set).unwrap(), "continuation.csv");
}

/// Checks that the state and the points found so far are kept.
#[test]
fn a_curve_with_too_many_points_stops() {
    let out = tempfile::tempdir().unwrap();
    let scene = built(&[
        "periodic.continuation.parameter=\"traction[0].y.amplitude\"",
        "periodic.continuation.to=60.0",
        "periodic.continuation.max_points=2",
    ]);
    let result = compute(&scene.unwrap(), &RunOptions::into_folder(out.path())).unwrap();
    assert_eq!(result.outcome.reason(), Some(EndReason::MaxSteps));
    assert_eq!(result.document["reason"], "max_steps");
    let table = std::fs::read_to_string(out.path().join("continuation.csv")).unwrap();
    assert_eq!(Table::parse(&table).unwrap().rows.len(), 2);
}

/// Checks that an interruption after the second point keeps the state and the points before it.
#[test]
fn an_interrupted_curve_keeps_its_points() {
    static INTERRUPT: AtomicBool = AtomicBool::new(false);
    struct AtParameter;
    impl ProgressSink for AtParameter {
        fn on_progress(&self, line: &dyn Fn() -> String) {
            let parameter = line().split_once(" = ").map(|(_, value)| value.parse::<f64>());
            if let Some(Ok(value)) = parameter
                && value > 31.0
            {
                INTERRUPT.store(true, Ordering::Relaxed);
            }
        }
    }
    let out = tempfile::tempdir().unwrap();
    let scene = built(&[
        "periodic.continuation.parameter=\"traction[0].y.amplitude\"",
        "periodic.continuation.to=40.0",
    ]);
    let options = RunOptions {
        interrupt: Some(&INTERRUPT),
        progress: &AtParameter,
        ..RunOptions::into_folder(out.path())
    };
    let result = compute(&scene.unwrap(), &options).unwrap();
    assert_eq!(result.outcome.reason(), Some(EndReason::Interrupted));
    let curve = result.periodic.unwrap().continuation.unwrap();
    let parameters: Vec<f64> = curve.points.iter().map(|point| point.parameter).collect();
    assert!(!parameters.is_empty() && parameters.iter().all(|value| *value <= 31.0));
}

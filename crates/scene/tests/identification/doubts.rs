//! Reports of undetermined parameters.

use std::path::Path;
use std::sync::Mutex;

use myovib_scene::fit::{FitOptions, FitResult, Outcome};
use myovib_scene::watch::ProgressSink;

use crate::fits::{fitted, measure};
use crate::{SMALL, scene};

/// Sink that records the unconditional progress lines.
#[derive(Default)]
struct RecordedNotes(Mutex<Vec<String>>);

impl ProgressSink for RecordedNotes {
    fn on_progress(&self, _: &dyn Fn() -> String) {}

    fn report_now(&self, line: &dyn Fn() -> String) {
        self.0.lock().unwrap().push(line());
    }
}

/// Fits the cantilever's parameters with profiles, to measurements whose noise is `noise` times the given standard
/// deviation. Returns the result and the progress lines.
fn profiled(folder: &Path, keys: &[&str], more: &str, noise: f64) -> (FitResult, Vec<String>) {
    let path = scene(folder, keys, more);
    let data = folder.join("measured.csv");
    measure(&path, &SMALL, noise, &data);
    let kept = RecordedNotes::default();
    let result = fitted(path, data, &SMALL, |options| FitOptions {
        profile: true,
        progress: &kept,
        ..options
    });
    (result.unwrap(), kept.0.into_inner().unwrap())
}

/// A load that begins long after the last measurement, and whose size is a parameter.
const LATE: &str = "[[traction]]\ngroup = \"load\"\n\
                    y = { type = \"step\", value = 1.0, start = 50.0, rise = 0.1 }\n\
                    [[parameter]]\nkey = \"traction[1].y.value\"\nlow = 0.0\n";

#[test]
fn a_parameter_without_effect_is_marked() {
    let folder = tempfile::tempdir().unwrap();
    let (result, reported) = profiled(folder.path(), &["material[0].c10"], LATE, 1.0);
    assert!(result.fit.is_converged(), "{}", result.ending());
    assert_eq!([0, 1].map(|j| result.fit.acts(j)), [true, false]);
    assert!(result.unknown().is_empty());
    // The standard error of a single parameter is the standard deviation of the residuals divided by the norm of their
    // derivatives, up to the rounding errors of sums of 40 squares.
    let exact = result.deviation() / result.fit.jacobian.column(0).norm();
    let error = result.uncertainty.standard_errors[0];
    assert!((error / exact - 1.0).abs() < 1e-13, "{error:e} {exact:e}");
    let document = result.document();
    let idle = &document["parameters"][1];
    for key in ["/standard_error", "/interval/0", "/interval/1", "/profile_interval"] {
        assert!(idle.pointer(key).unwrap().is_null(), "{key}: {idle}");
    }
    assert_eq!((&idle["acts"], &idle["passes_bound"]), (&false.into(), &false.into()));
    assert_eq!(document["parameters"][0]["acts"], true);
    assert!(document["correlation"][0][1].is_null());
    let why = result.profiles[1].as_ref().unwrap_err();
    assert_eq!(why, "no measurement depends on it");
    assert!(result.profiles[0].is_ok());
    assert_eq!(reported, ["profile 1 of 2, about ten fits each: material[0].c10"]);
}

/// Checks a damping whose confidence interval extends below zero, to values that no scene allows. With and without the
/// bound 0, the interval is marked and the profile is open on that side.
#[test]
fn an_interval_that_passes_a_bound_is_marked_whether_or_not_the_scene_names_the_bound() {
    for bound in ["", "low = 0.0\n"] {
        let folder = tempfile::tempdir().unwrap();
        let alpha = format!("[[parameter]]\nkey = \"solid.rayleigh_mass\"\n{bound}");
        let (result, reported) = profiled(folder.path(), &[], &alpha, 20.0);
        // The noise is 20 times the stated noise.
        assert_eq!(result.outcome(), Outcome::DoesNotFit);
        let [low, _] = result.uncertainty.intervals(0.95)[0];
        assert!(low < 0.0 && 0.0 < result.fit.values[0]);
        assert_eq!(reported.len(), 1, "{reported:?}");
        assert!(result.passes_bound(0));
        assert_eq!(result.document()["parameters"][0]["passes_bound"], true);
        let [below, above] = result.profiles[0].as_ref().unwrap().interval;
        assert!(below.is_none() && above.unwrap() > result.fit.values[0]);
    }
}

//! Fits to measurements of which the truth is known.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use myovib_scene::fit::{FitOptions, FitResult, compute};
use myovib_scene::sensitivity::{Parametrised, Watcher, compute as follow};
use rand::{Rng, SeedableRng};

use crate::{scene, set};

/// What all runs share: 0.2 s of a load that rises at once.
const COMMON: [&str; 6] = [
    "time.end=0.2",
    "traction[0].y.shift=1",
    "integrator.method=radau9",
    "integrator.rtol=1e-5",
    "probe[0].every=0.01",
    "probe[0].quantities=[\"u\"]",
];

/// The outputs of the scene with a noise of 1 % of their largest size, as a table.
fn measure(path: &Path, truth: &[&str], noise: f64, file: &Path) {
    let it = Parametrised::load(path, &set(&[&COMMON[..], truth].concat())).unwrap();
    let watcher = Watcher {
        interrupt: None,
        progress: &(),
    };
    let curves = follow(&it, watcher).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let sizes: Vec<f64> = (0..curves.outputs.len())
        .map(|k| {
            curves
                .samples
                .iter()
                .fold(0.0, |size: f64, s| size.max(s.values[k].abs()))
        })
        .collect();
    let mut text = String::from("observableId,time,measurement,noiseParameters\n");
    for sample in &curves.samples[1..] {
        for (k, name) in curves.outputs.iter().enumerate() {
            // Twelve uniform numbers make one that is normal enough, of variance 1.
            let normal: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
            let deviation = 0.01 * sizes[k];
            let value = sample.values[k] + noise * deviation * normal;
            writeln!(text, "{name},{},{value:e},{deviation:e}", sample.t).unwrap();
        }
    }
    std::fs::write(file, text).unwrap();
}

fn fit(path: PathBuf, data: PathBuf, more: &[&str], profile: bool) -> FitResult {
    let out = path.with_file_name("fit");
    compute(&FitOptions {
        scene: path,
        set: set(&[&COMMON[..], more].concat()),
        experiments: vec![(data, Vec::new())],
        out,
        tolerance: 1e-5,
        max_iterations: 30,
        profile,
        interrupt: None,
        progress: &(),
    })
    .unwrap()
}

#[test]
fn three_parameters_are_found_in_noise_within_their_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(
        folder.path(),
        &["material[0].c10", "solid.alpha", "solid.kappa"],
        "",
    );
    let data = folder.path().join("measured.csv");
    let truth = ["material[0].c10=1.3e4", "solid.alpha=3", "solid.kappa=5e4"];
    measure(&path, &truth, 1.0, &data);
    // From the values of the scene, 1e4, 1 and 1e5.
    let result = fit(path, data, &[], false);
    assert!(result.fit.is_converged(), "{}", result.ending());
    let truth = [1.3e4, 3.0, 1.0 / 5e4];
    for (j, [low, high]) in result.uncertainty.intervals(0.999).into_iter().enumerate() {
        println!(
            "{}: {low:e} {:e} {high:e}",
            result.fit.names[j], result.fit.values[j]
        );
        assert!(
            low < truth[j] && truth[j] < high,
            "parameter {j}: {low} {high}"
        );
    }
    // 40 residuals in units of their standard deviation: 1 ± 0.12, thrice that.
    assert!(
        (result.deviation() - 1.0).abs() < 0.36,
        "{}",
        result.deviation()
    );
    assert!(result.unknown().is_empty());
    // The issue asks for the time of 20 plain runs for six parameters.
    assert!(result.runs[0] + result.runs[1] < 30, "{:?}", result.runs);
    let history = std::fs::read_to_string(folder.path().join("fit/history.csv")).unwrap();
    assert_eq!(history.lines().count(), result.fit.history.len() + 1);
}

/// At small strains c10 and c01 act by their sum alone.
#[test]
fn what_the_data_cannot_tell_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10", "material[0].c01"], "");
    let data = folder.path().join("measured.csv");
    let small = ["traction[0].y.amplitude=1", "material[0].c01=5e3"];
    measure(&path, &small, 1.0, &data);
    let result = fit(path, data, &small, false);
    let unknown = result.unknown();
    assert_eq!(unknown.len(), 1, "{:?}", result.identifiability);
    let change: Vec<f64> = unknown[0]
        .shares
        .iter()
        .zip(&result.fit.values)
        .map(|(share, value)| share * value)
        .collect();
    // As much of one as of the other, with opposite signs, to the strain's order.
    assert!((change[0] / change[1] + 1.0).abs() < 0.05, "{change:?}");
    let words = result.in_words(unknown[0]);
    assert!(words.contains("c10") && words.contains("c01"), "{words}");
    // Their sum is known.
    let sum = result.fit.values[0] + result.fit.values[1];
    assert!((sum / 1.5e4 - 1.0).abs() < 0.05, "{sum}");
}

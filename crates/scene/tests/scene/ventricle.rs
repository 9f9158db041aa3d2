//! Contraction of a ventricle with inertia: case A of Aróstica et al. (2025), on a coarse mesh.

use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use serde_json::Value;

const POINTS: [&str; 2] = ["p0", "p1"];

/// Output of a run.
struct Run {
    document: Value,
    /// Displacements of both points, m, every 0.01 s.
    curves: [Vec<[f64; 3]>; 2],
    /// Volume of the cavity, m³, at the same times.
    cavity: Vec<f64>,
}

/// Runs a scene to an end time.
fn run(scene: &str, t_end: &str) -> Run {
    run_with(scene, &[format!("time.end={t_end}")])
}

/// Runs the beat of the fine ventricle with a tenth of its tolerances, and with order 9. Newton's iteration limits the
/// steps here, so that tolerances alone barely increase their number (152 instead of 146 on the coarse mesh).
fn tighter() -> Run {
    let set = ["method=radau9", "rtol=1e-4", "atol.u=1e-6", "atol.v=1e-4", "atol.p=10.0"];
    run_with("ventricle", &set.map(|set| format!("integrator.{set}")))
}

fn run_with(scene: &str, set: &[String]) -> Run {
    let scene = Scene::built_in(scene, set).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions::into_folder(folder.path());
    let document = compute(&scene, &options).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    let rows = |probe: &str| -> Vec<Vec<f64>> {
        let path = folder.path().join(format!("{probe}.csv"));
        let table = Table::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
        let rows = table.rows.iter();
        rows.map(|row| table.numbers(row).unwrap()).collect()
    };
    let curve = |point| rows(point).iter().map(|row| [row[1], row[2], row[3]]).collect();
    Run {
        curves: POINTS.map(curve),
        cavity: rows("cavity").iter().map(|row| row[1]).collect(),
        document,
    }
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Returns the mean distance between two curves from row `from` on, relative to the largest displacement of the second.
fn deviation(curve: &[[f64; 3]], other: &[[f64; 3]], from: usize) -> f64 {
    let largest = other.iter().map(|u| distance(u, &[0.0; 3]));
    let largest = largest.fold(0.0, f64::max);
    let pairs = curve.iter().zip(other).skip(from);
    let distances: Vec<f64> = pairs.map(|(a, b)| distance(a, b)).collect();
    distances.iter().sum::<f64>() / distances.len() as f64 / largest
}

/// Returns the benchmark's error measure (its eq. 21): the mean over all times of |u - ū|/|ū|. In
/// the first 0.16 s, the body rests and ū is noise of 5e-6 m. These times contribute 0.17 for a
/// code at rest.
fn relative_deviation(curve: &[[f64; 3]], mean: &[[f64; 3]]) -> f64 {
    let each = curve.iter().zip(mean);
    let each = each.map(|(u, mean)| distance(u, mean) / distance(mean, &[0.0; 3]));
    each.sum::<f64>() / curve.len() as f64
}

/// Returns our run at tolerances a hundred times tighter and another order. Its key `provenance`
/// contains the command.
fn reference() -> Value {
    let text = include_str!("../../../../data/references/ventricle_coarse.json");
    serde_json::from_str(text).unwrap()
}

/// Returns the mean of ten codes, and its spread.
fn codes() -> Value {
    let text = include_str!("../../../../data/references/s11_arostica_0A.json");
    serde_json::from_str(text).unwrap()
}

fn curve(table: &Value, point: &str) -> Vec<[f64; 3]> {
    serde_json::from_value(table[point].clone()).unwrap()
}

/// Returns the largest distance between two curves over their common times, relative to the largest displacement.
fn error(curve: &[[f64; 3]], other: &[[f64; 3]]) -> f64 {
    let largest = other.iter().map(|u| distance(u, &[0.0; 3]));
    let largest = largest.fold(0.0, f64::max);
    let pairs = curve.iter().zip(other);
    pairs.map(|(a, b)| distance(a, b)).fold(0.0, f64::max) / largest
}

/// Checks that the ventricle is at rest, the onset at 0.16 s, and the first hundredths of a second of the contraction.
/// The test takes ten seconds of CPU for a body of 28 844 unknowns.
#[test]
fn the_ventricle_begins_to_contract_as_in_a_tighter_run() {
    let Run { document, curves, cavity } = run("ventricle-coarse", "0.19");
    for (point, ours) in POINTS.iter().zip(&curves) {
        let reference = curve(&reference(), point);
        // The tolerance is the rtol of the scene.
        assert!(error(ours, &reference) < 1e-3, "{point}");
        assert!(distance(&ours[19], &[0.0; 3]) > 4e-3, "{point}: {:?}", ours[19]);
    }
    assert_eq!(document["unknowns"], 28_844);
    // The cavity is an ellipsoid with the semi-axes 0.09, 0.025 and 0.025 m, cut at 5/17 of the first semi-axis.
    // Straight faces between its points are inside the ellipsoid: about 16 faces around it reduce the volume by 1 −
    // sin(2π/16)/(2π/16) = 2.6 %.
    let (a, b, cut) = (0.09, 0.025, 0.09 * 5.0 / 17.0);
    let cubes = (f64::powi(cut, 3) + f64::powi(a, 3)) / (3.0 * a * a);
    let ellipsoid = std::f64::consts::PI * b * b * (a + cut - cubes);
    let ratio = cavity[0] / ellipsoid;
    assert!(0.97 < ratio && ratio < 1.0, "{ratio}");
    // The ventricle is at rest until 0.16 s, and then contracts.
    assert!((cavity[16] / cavity[0] - 1.0).abs() < 1e-12);
    assert!(cavity[19] < 0.9 * cavity[0], "{cavity:?}");
}

/// Compares the whole beat with a tighter run, another program on the same mesh, and ten codes.
#[test]
#[ignore = "two minutes of CPU"]
fn the_beat_is_that_of_other_programs() {
    let Run { document, curves, .. } = run("ventricle-coarse", "1.0");
    assert!(document["steps"].as_u64().unwrap() <= 200);
    let codes = codes();
    // Results in mm at 0.48 s of the generalized-α method with dt = 2 ms and P2–P1 elements, followed by their mean and
    // relative deviation from the mean of the ten codes on this coarse mesh.
    let other = [[-27.56, 1.26, 3.59], [-19.66, -2.47, 0.86]];
    let from_codes = [[0.066, 0.31], [0.065, 0.40]];
    let found = POINTS.iter().zip(&curves).zip(other.iter().zip(from_codes));
    for ((point, ours), (other, from_codes)) in found {
        let tighter = curve(&reference(), point);
        assert_eq!((ours.len(), tighter.len()), (101, 101));
        // The tolerance is the rtol of the scene.
        let error = error(ours, &tighter);
        println!("{point}: own error in time {error:.1e}");
        assert!(error < 1e-3, "{point}: {error}");
        // The tolerance is 0.2 %, because the error of the time integration is below 2e-5 m up to 0.3 s.
        let apart = distance(&ours[48], &other.map(|x| 1e-3 * x));
        assert!(apart < 6e-5, "{point}: {apart}");
        // The published values have two digits, so an error of 1e-3 is small.
        let mean = curve(&codes["mean"], point);
        let [deviation, relative] = [deviation(ours, &mean, 17), relative_deviation(ours, &mean)];
        println!("{point}: mean deviation {deviation:.4}, RED {relative:.4}");
        assert!(
            (deviation - from_codes[0]).abs() < 1e-3 && (relative - from_codes[1]).abs() < 1e-2,
            "{point}: {deviation} {relative}"
        );
    }
}

/// Compares the benchmark's fine mesh, 184 007 unknowns, with the ten codes. A run at a tenth of
/// the tolerances gives the time integration error.
#[test]
#[ignore = "two hours of CPU, 4 GB of memory"]
fn the_beat_on_the_fine_mesh_is_that_of_ten_codes() {
    let Run { document, curves, .. } = run("ventricle", "1.0");
    assert_eq!(document["unknowns"], 184_007);
    assert!(document["steps"].as_u64().unwrap() <= 200);
    // The limits are the second-largest values of the ten codes.
    for ((point, ours), largest) in POINTS.iter().zip(&curves).zip([0.30, 0.38]) {
        let mean = curve(&codes()["mean"], point);
        let [deviation, relative] = [deviation(ours, &mean, 17), relative_deviation(ours, &mean)];
        println!("{point}: mean deviation {deviation:.4}, RED {relative:.4}");
        // The limit is below the deviation of the coarse mesh, 0.065.
        assert!(deviation < 0.05, "{point}: {deviation}");
        assert!(relative < largest, "{point}: {relative}");
    }
    let tighter = tighter();
    assert_eq!(tighter.document["order"], 9);
    for ((point, ours), tighter) in POINTS.iter().zip(&curves).zip(&tighter.curves) {
        assert_eq!((ours.len(), tighter.len()), (101, 101));
        let error = error(ours, tighter);
        println!("{point}: own error in time {error:.1e}");
        // The tolerance is the rtol of the scene.
        assert!(error < 1e-3, "{point}: {error}");
    }
}

//! Runs of a scene given as text, and the difference between their results.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, RunResult, compute};

pub(crate) fn build(text: &str, set: &[&str], folder: &Path) -> Result<Scene, String> {
    let set: Vec<String> = set.iter().map(|&s| s.to_owned()).collect();
    Scene::build("scene.toml", text, &set, folder).map_err(|error| error.to_string())
}

pub(crate) fn run(text: &str, set: &[&str], out: &Path) -> RunResult {
    let scene = build(text, set, out.parent().unwrap()).unwrap();
    compute(&scene, &RunOptions::into_folder(out)).unwrap()
}

pub(crate) fn rows(out: &Path, probe: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(out.join(format!("{probe}.csv"))).unwrap();
    let table = Table::parse(&text).unwrap();
    let rows = table.rows.iter();
    rows.map(|row| table.numbers(row).unwrap()).collect()
}

/// Returns the largest difference in each column from `first` on, relative to the column's largest
/// value. Column 0 is time.
pub(crate) fn apart(a: &[Vec<f64>], b: &[Vec<f64>], first: usize) -> f64 {
    assert_eq!(a.len(), b.len());
    let columns = first..a[0].len();
    let apart = columns.map(|k| {
        let size = a.iter().fold(1e-300, |m: f64, row| m.max(row[k].abs()));
        let pairs = a.iter().zip(b);
        pairs.fold(0.0, |m: f64, (a, b)| m.max((a[k] - b[k]).abs())) / size
    });
    apart.fold(0.0, f64::max)
}

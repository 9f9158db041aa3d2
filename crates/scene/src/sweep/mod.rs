//! A sweep: one scene over a grid of values, a folder for each case.
//!
//! Cases are numbered by the grid (the last key changes fastest) and depend on nothing but
//! their number, so that any of them can be computed alone, on any machine, with the same result.

mod grid;

use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anyhow::Context;
use serde_json::{Value, json};

use crate::run::{self, Existing, RunOptions, RunResult};
use crate::watch::Tell;
use crate::{Scene, atomic_file, parallel};
use grid::{Axis, Case, case_number, cases};

/// A scene, what varies, and where the cases go.
pub struct SweepOptions<'a> {
    /// The scene: a TOML file, or the name of a built-in scene.
    pub scene: PathBuf,
    /// Values of keys: `key=a,b,c` or `key=lo..hi:n`.
    pub vary: Vec<String>,
    /// Overrides of all cases.
    pub set: Vec<String>,
    /// Folder for the cases.
    pub out: PathBuf,
    /// The case K/N to compute, from 1; without it all.
    pub case: Option<String>,
    /// Cases at a time.
    pub n_threads: NonZeroUsize,
    /// A flag that ends the sweep in good order.
    pub interrupt: Option<&'static AtomicBool>,
    /// Who is told how far the sweep is.
    pub progress: &'a dyn Tell,
    /// What is done with a case that was computed, in its folder.
    pub finished: &'a (dyn Fn(&Path, &Scene, &RunResult) -> anyhow::Result<()> + Sync),
}

/// The table of a sweep.
#[derive(Debug, Clone)]
pub struct SweepResult {
    /// The body of `sweep.json`.
    pub document: Value,
    /// `sweep.csv`.
    pub csv: String,
}

/// Runs the cases.
///
/// # Errors
/// Wrong options, or a folder that cannot be written. A case that fails is a row.
pub fn compute(options: &SweepOptions<'_>) -> anyhow::Result<SweepResult> {
    let axes: Vec<Axis> = options
        .vary
        .iter()
        .map(|text| Axis::parse(text))
        .collect::<Result<_, _>>()?;
    let all = cases(&axes);
    let wanted = match &options.case {
        None => all.clone(),
        Some(text) => vec![all[case_number(text, all.len())?].clone()],
    };
    // A scene that is wrong as it is would be wrong in every case.
    let first = [&options.set[..], &all[0].set].concat();
    let sweep = Sweep {
        options,
        scene: Scene::load(&options.scene, &first)?.text().to_owned(),
    };
    fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make {}", options.out.display()))?;

    sweep.compute_all(&wanted)?;

    let rows: Vec<Value> = all.iter().map(|case| sweep.row(&axes, case)).collect();
    let document = json!({ "rows": rows });
    let csv = table(&axes, &rows);
    for (name, text) in [
        ("sweep.csv", csv.clone()),
        ("sweep.json", crate::json::document("sweep", &document)?),
    ] {
        atomic_file::save(&options.out.join(name), text)?;
    }
    Ok(SweepResult { document, csv })
}

/// What all cases share.
struct Sweep<'a> {
    options: &'a SweepOptions<'a>,
    /// The scene's text, without overrides.
    scene: String,
}

impl Sweep<'_> {
    fn is_interrupted(&self) -> bool {
        let flag = self.options.interrupt;
        flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn folder(&self, case: &Case) -> PathBuf {
        self.options
            .out
            .join(format!("case-{:04}", case.number + 1))
    }

    fn compute_all(&self, cases: &[Case]) -> anyhow::Result<()> {
        let done = AtomicUsize::new(0);
        let outcomes = parallel::map(cases, self.options.n_threads, |case| {
            if self.is_interrupted() {
                return Ok(());
            }
            if !self.is_finished(case) {
                self.compute(case)?;
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let progress = self.options.progress;
            progress.tell(&|| format!("{done} of {} cases", cases.len()));
            Ok(())
        });
        outcomes.into_iter().collect()
    }

    /// The record of a case, if it was computed of the same scene with the same overrides.
    fn record(&self, case: &Case) -> Option<Value> {
        let text = fs::read_to_string(self.folder(case).join("case.json")).ok()?;
        let record: Value = serde_json::from_str(&text).ok()?;
        let same = record["scene"] == self.scene
            && record["set"] == json!(case.set)
            && record["common"] == json!(self.options.set);
        same.then_some(record)
    }

    /// Whether it was computed to an end of its own.
    fn is_finished(&self, case: &Case) -> bool {
        self.record(case)
            .is_some_and(|record| record["result"]["reason"] != "interrupted")
    }

    /// Computes a case and records what came of it.
    fn compute(&self, case: &Case) -> anyhow::Result<()> {
        let (options, folder) = (self.options, self.folder(case));
        let set = [&options.set[..], &case.set].concat();
        let run = RunOptions {
            existing: Existing::Overwrite,
            interrupt: options.interrupt,
            ..RunOptions::into_folder(&folder)
        };
        let outcome = Scene::load(&options.scene, &set).and_then(|scene| {
            let result = run::compute(&scene, &run)?;
            (options.finished)(&folder, &scene, &result)?;
            Ok(result)
        });
        let result = match outcome {
            Ok(result) => result.document,
            Err(failure) => json!({ "outcome": "failed", "message": format!("{failure:#}") }),
        };
        let record = json!({
            "scene": self.scene,
            "set": case.set,
            "common": options.set,
            "result": result,
        });
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        atomic_file::save(&folder.join("case.json"), record.to_string())
    }

    fn row(&self, axes: &[Axis], case: &Case) -> Value {
        let mut row = serde_json::Map::new();
        row.insert("case".to_owned(), json!(case.number + 1));
        for (axis, set) in axes.iter().zip(&case.set) {
            let value = set.split_once('=').map_or("", |(_, value)| value);
            row.insert(axis.key.clone(), json!(value));
        }
        let record = self.record(case);
        let record = record.unwrap_or(json!({ "result": { "outcome": "not computed" } }));
        for column in COLUMNS {
            row.insert(column.to_owned(), record["result"][column].clone());
        }
        row.insert("message".to_owned(), record["result"]["message"].clone());
        let probes = &record["result"]["scene"]["probe"];
        let probes = last_rows(&self.folder(case), probes);
        row.insert("probes".to_owned(), json!(probes));
        Value::Object(row)
    }
}

/// The results that a row of the table shows.
const COLUMNS: [&str; 9] = [
    "outcome",
    "index",
    "steps",
    "error_test_failures",
    "step_solve_failures",
    "newton_iterations",
    "t_reached",
    "constraint_drift",
    "cpu_seconds",
];

/// The last row of each probe of the run; none of one that failed.
fn last_rows(folder: &Path, probes: &Value) -> BTreeMap<String, Vec<f64>> {
    let names = probes.as_array().into_iter().flatten();
    names
        .filter_map(|probe| {
            let name = probe["name"].as_str()?;
            let text = fs::read_to_string(folder.join(format!("{name}.csv"))).ok()?;
            let numbers = text.lines().skip(1).last()?.split(',');
            let values = numbers.filter_map(|word| word.parse().ok()).collect();
            Some((name.to_owned(), values))
        })
        .collect()
}

fn table(axes: &[Axis], rows: &[Value]) -> String {
    let keys = axes.iter().map(|axis| axis.key.as_str());
    let names: Vec<&str> = std::iter::once("case").chain(keys).chain(COLUMNS).collect();
    let mut text = names.join(",") + "\n";
    for row in rows {
        let words: Vec<String> = names
            .iter()
            .map(|name| match &row[*name] {
                Value::String(word) => word.clone(),
                Value::Null => String::new(),
                other => other.to_string(),
            })
            .collect();
        text += &(words.join(",") + "\n");
    }
    text
}

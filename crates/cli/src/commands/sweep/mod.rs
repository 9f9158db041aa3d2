//! `myovib sweep`: one scene over a grid of values, a folder for each case.
//!
//! Cases are numbered by the grid (the last `--vary` changes fastest) and depend on nothing but
//! their number, so that any of them can be computed alone, on any machine, with the same result.

mod grid;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::Context;
use clap::Args;
use serde_json::{Value, json};

use crate::args::{self, CommonArgs};
use crate::atomic_file;
use crate::commands::run::{self, RunArgs};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::{interrupt, parallel};
use grid::{Axis, Case, case_number, cases};

/// Options of `myovib sweep`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib sweep scene.toml --vary solid.kappa=1e4,1e5,inf --out kappa\n  \
    myovib sweep scene.toml --vary solid.beta=1e-5..1e-3:5 --vary solid.kappa=1e5,inf\n  \
    myovib sweep scene.toml --vary solid.kappa=1e4,1e5,inf --case 2/3\n\n\
    A range lo..hi:n has n values, equally spaced. Finished cases are not computed again, \
    unless the scene has changed. Returns 0 when every case was recorded, also those that failed.")]
pub struct SweepArgs {
    /// The scene: a TOML file, or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Values of a key: key=a,b,c or key=lo..hi:n; several make a grid.
    #[arg(long, value_name = "KEY=VALUES", required = true)]
    pub vary: Vec<String>,

    /// Change a value of all cases.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Folder for the cases.
    #[arg(long, value_name = "DIR", default_value = "sweep", value_parser = args::output_folder)]
    pub out: PathBuf,

    /// Compute case K of N only, from 1; N must be the number of cases.
    #[arg(long, value_name = "K/N")]
    pub case: Option<String>,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Runs the cases.
///
/// # Errors
/// Wrong options, or a folder that cannot be written. A case that fails is a row.
pub fn run(args: &SweepArgs) -> anyhow::Result<Exit> {
    let axes: Vec<Axis> = args
        .vary
        .iter()
        .map(|text| Axis::parse(text))
        .collect::<Result<_, _>>()?;
    let all = cases(&axes);
    let wanted = match &args.case {
        None => all.clone(),
        Some(text) => vec![all[case_number(text, all.len())?].clone()],
    };
    // A scene that is wrong as it is would be wrong in every case.
    let first = [&args.set[..], &all[0].set].concat();
    let sweep = Sweep {
        args,
        scene: Scene::load(&args.scene, &first)?.text().to_owned(),
    };
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;

    sweep.compute_all(&wanted)?;

    let rows: Vec<Value> = all.iter().map(|case| sweep.row(&axes, case)).collect();
    let document = json!({ "rows": rows });
    let csv = table(&axes, &rows);
    for (name, text) in [
        ("sweep.csv", csv.clone()),
        ("sweep.json", crate::json::document("sweep", &document)?),
    ] {
        atomic_file::save(&args.out.join(name), text)?;
    }
    args.common.give("sweep", &csv, &document)?;
    Ok(if is_interrupted() {
        Exit::Interrupted
    } else {
        Exit::Done
    })
}

fn is_interrupted() -> bool {
    interrupt::flag().load(Ordering::Relaxed)
}

/// What all cases share.
struct Sweep<'a> {
    args: &'a SweepArgs,
    /// The scene's text, without overrides.
    scene: String,
}

impl Sweep<'_> {
    fn folder(&self, case: &Case) -> PathBuf {
        self.args.out.join(format!("case-{:04}", case.number + 1))
    }

    fn compute_all(&self, cases: &[Case]) -> anyhow::Result<()> {
        let done = AtomicUsize::new(0);
        let common = &self.args.common;
        let progress = Mutex::new(Progress::new(common.quiet));
        let outcomes = parallel::map(cases, common.n_threads(), |case| {
            if is_interrupted() {
                return Ok(());
            }
            if !self.is_finished(case) {
                self.compute(case)?;
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if let Ok(mut progress) = progress.lock() {
                progress.show(|| format!("{done} of {} cases", cases.len()));
            }
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
            && record["common"] == json!(self.args.set);
        same.then_some(record)
    }

    /// Whether it was computed to an end of its own.
    fn is_finished(&self, case: &Case) -> bool {
        self.record(case)
            .is_some_and(|record| record["result"]["reason"] != "interrupted")
    }

    /// Computes a case and records what came of it.
    fn compute(&self, case: &Case) -> anyhow::Result<()> {
        let (args, folder) = (self.args, self.folder(case));
        let run = RunArgs {
            scene: args.scene.clone(),
            out: folder.clone(),
            set: [&args.set[..], &case.set].concat(),
            resume: false,
            overwrite: true,
            common: CommonArgs {
                json: None,
                quiet: true,
                threads: None,
            },
        };
        let outcome =
            Scene::load(&run.scene, &run.set).and_then(|scene| run::compute(&scene, &run));
        let result = match outcome {
            Ok(result) => result.document,
            Err(failure) => json!({ "outcome": "failed", "message": format!("{failure:#}") }),
        };
        let record = json!({
            "scene": self.scene,
            "set": case.set,
            "common": args.set,
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

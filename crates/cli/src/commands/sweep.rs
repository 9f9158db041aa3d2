//! `myovib sweep`: one scene over a grid of values, a folder for each case.
//!
//! Cases are numbered by the grid (the last `--vary` changes fastest) and depend on nothing but
//! their number, so that any of them can be computed alone, on any machine, with the same result.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use anyhow::Context;
use clap::Args;
use serde_json::{Value, json};

use crate::args::CommonArgs;
use crate::atomic_file;
use crate::commands::run::{self, RunArgs};
use crate::error::InputError;
use crate::exit::Exit;
use crate::progress::Progress;
use crate::scene::Scene;

/// Options of `myovib sweep`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib sweep scene.toml --vary solid.kappa=1e4,1e5,inf --out kappa\n  \
    myovib sweep scene.toml --vary solid.beta=1e-5..1e-3:5 --vary solid.kappa=1e5,inf\n  \
    myovib sweep scene.toml --vary solid.kappa=1e4,1e5,inf --case 2/3\n\n\
    A range lo..hi:n has n values, equally spaced. Finished cases are not computed again. \
    Returns 0 when every case was recorded, also those that failed.")]
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
    #[arg(long, value_name = "DIR", default_value = "sweep")]
    pub out: PathBuf,

    /// Compute case K of N only, from 1; N must be the number of cases.
    #[arg(long, value_name = "K/N")]
    pub case: Option<String>,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// One case: its number from 0, and its overrides.
#[derive(Debug, Clone)]
struct Case {
    number: usize,
    set: Vec<String>,
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
    Scene::load(&args.scene, &first)?;
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;

    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))?;
    compute_all(args, &wanted, &interrupted);

    let rows: Vec<Value> = all.iter().map(|case| row(args, &axes, case)).collect();
    let document = json!({ "rows": rows });
    let csv = table(&axes, &rows);
    for (name, text) in [
        ("sweep.csv", csv.clone()),
        ("sweep.json", crate::json::document("sweep", &document)?),
    ] {
        let path = args.out.join(name);
        atomic_file::write(&path, |file: &mut dyn Write| {
            file.write_all(text.as_bytes())
        })
        .with_context(|| format!("cannot write {}", path.display()))?;
    }
    args.common.give("sweep", &csv, &document)?;
    Ok(if interrupted.load(Ordering::Relaxed) {
        Exit::Interrupted
    } else {
        Exit::Done
    })
}

/// A key and its values, as text.
#[derive(Debug)]
struct Axis {
    key: String,
    values: Vec<String>,
}

impl Axis {
    fn parse(text: &str) -> Result<Self, InputError> {
        let wrong = |message: &str| {
            InputError::new(message.to_owned())
                .at(format!("--vary {text}"))
                .allowed("key=a,b,c or key=lo..hi:n, as in solid.beta=1e-5..1e-3:5")
        };
        let (key, values) = text
            .split_once('=')
            .ok_or_else(|| wrong("values are missing"))?;
        let values = match values.split_once("..") {
            None => values
                .split(',')
                .map(|value| value.trim().to_owned())
                .collect(),
            Some((low, rest)) => {
                let (high, n) = rest
                    .split_once(':')
                    .ok_or_else(|| wrong("`:n` is missing"))?;
                let number = |word: &str| word.trim().parse::<f64>().ok();
                let (Some(low), Some(high), Ok(n)) =
                    (number(low), number(high), n.trim().parse::<usize>())
                else {
                    return Err(wrong("a range is made of numbers"));
                };
                if n < 2 {
                    return Err(wrong("a range has two values at least"));
                }
                let value = |i: usize| {
                    let s = i as f64 / (n - 1) as f64;
                    format!("{:e}", (1.0 - s) * low + s * high)
                };
                (0..n).map(value).collect()
            }
        };
        Ok(Self {
            key: key.trim().to_owned(),
            values,
        })
    }
}

/// All combinations; the last axis changes fastest.
fn cases(axes: &[Axis]) -> Vec<Case> {
    let count: usize = axes.iter().map(|axis| axis.values.len()).product();
    (0..count)
        .map(|number| {
            let mut rest = number;
            let mut set: Vec<String> = axes
                .iter()
                .rev()
                .map(|axis| {
                    let value = &axis.values[rest % axis.values.len()];
                    rest /= axis.values.len();
                    format!("{}={value}", axis.key)
                })
                .collect();
            set.reverse();
            Case { number, set }
        })
        .collect()
}

fn case_number(text: &str, count: usize) -> Result<usize, InputError> {
    let number = |word: &str| word.parse::<usize>().ok();
    let numbers = text
        .split_once("/")
        .and_then(|(k, n)| Some((number(k)?, number(n)?)));
    match numbers {
        Some((k, n)) if n == count && (1..=count).contains(&k) => Ok(k - 1),
        _ => Err(InputError::new("there is no such case")
            .at("--case")
            .found(text)
            .allowed(format!("1/{count} to {count}/{count}"))),
    }
}

fn folder(out: &Path, case: &Case) -> PathBuf {
    out.join(format!("case-{:04}", case.number + 1))
}

fn compute_all(args: &SweepArgs, cases: &[Case], interrupted: &AtomicBool) {
    let next = AtomicUsize::new(0);
    let done = AtomicUsize::new(0);
    let progress = Mutex::new(Progress::new(args.common.quiet));
    let worker = || {
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            if interrupted.load(Ordering::Relaxed) {
                return;
            }
            if !is_finished(args, case) {
                compute(args, case, interrupted);
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if let Ok(mut progress) = progress.lock() {
                progress.show(|| format!("{done} of {} cases", cases.len()));
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..args.common.n_threads().get().min(cases.len()) {
            scope.spawn(worker);
        }
    });
}

/// The record of a case, if it was computed with the same overrides to an end of its own.
fn record(args: &SweepArgs, case: &Case) -> Option<Value> {
    let text = fs::read_to_string(folder(&args.out, case).join("case.json")).ok()?;
    let record: Value = serde_json::from_str(&text).ok()?;
    let same = record["set"] == json!(case.set) && record["common"] == json!(args.set);
    same.then_some(record)
}

fn is_finished(args: &SweepArgs, case: &Case) -> bool {
    record(args, case).is_some_and(|record| record["result"]["reason"] != "interrupted")
}

/// Computes a case and records what came of it.
fn compute(args: &SweepArgs, case: &Case, interrupted: &AtomicBool) {
    let folder = folder(&args.out, case);
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
        Scene::load(&run.scene, &run.set).and_then(|scene| run::compute(&scene, &run, interrupted));
    let result = match outcome {
        Ok(result) => result.document,
        Err(failure) => json!({ "outcome": "failed", "message": format!("{failure:#}") }),
    };
    let record = json!({ "set": case.set, "common": args.set, "result": result });
    let written = fs::create_dir_all(&folder).and_then(|()| {
        atomic_file::write(&folder.join("case.json"), |file| {
            file.write_all(record.to_string().as_bytes())
        })
    });
    if let Err(error) = written {
        eprintln!("warning: cannot write into {}: {error}", folder.display());
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

fn row(args: &SweepArgs, axes: &[Axis], case: &Case) -> Value {
    let mut row = serde_json::Map::new();
    row.insert("case".to_owned(), json!(case.number + 1));
    for (axis, set) in axes.iter().zip(&case.set) {
        let value = set.split_once('=').map_or("", |(_, value)| value);
        row.insert(axis.key.clone(), json!(value));
    }
    let record = record(args, case).unwrap_or(json!({ "result": { "outcome": "not computed" } }));
    for column in COLUMNS {
        row.insert(column.to_owned(), record["result"][column].clone());
    }
    row.insert("message".to_owned(), record["result"]["message"].clone());
    row.insert(
        "probes".to_owned(),
        json!(last_rows(&folder(&args.out, case))),
    );
    Value::Object(row)
}

/// The last row of each probe.
fn last_rows(folder: &Path) -> BTreeMap<String, Vec<f64>> {
    let files = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()));
    files
        .filter(|path| path.extension().is_some_and(|extension| extension == "csv"))
        .filter_map(|path| {
            let text = fs::read_to_string(&path).ok()?;
            let last = text.lines().skip(1).last()?;
            let values = last
                .split(',')
                .filter_map(|word| word.parse().ok())
                .collect();
            Some((path.file_stem()?.to_string_lossy().into_owned(), values))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_key_changes_fastest_and_ranges_include_their_ends() {
        let axes = ["a.b=1,inf", "c=0..1:3"].map(|text| Axis::parse(text).unwrap());
        let cases = cases(&axes);
        let sets: Vec<String> = cases.iter().map(|case| case.set.join(" ")).collect();
        assert_eq!(sets[..3], ["a.b=1 c=0e0", "a.b=1 c=5e-1", "a.b=1 c=1e0"]);
        assert_eq!((sets.len(), sets[5].as_str()), (6, "a.b=inf c=1e0"));
        assert_eq!(case_number("6/6", 6).unwrap(), 5);
        assert!(case_number("7/6", 6).is_err() && case_number("1/5", 6).is_err());
    }

    #[test]
    fn wrong_axes_are_refused() {
        for text in ["a", "a=1..2", "a=1..2:1", "a=x..2:3"] {
            assert!(Axis::parse(text).is_err(), "{text}");
        }
    }
}

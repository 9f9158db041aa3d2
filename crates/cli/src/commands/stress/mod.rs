//! `myovib stress`: where each formulation breaks.
//!
//! Cast: a `Cell` is one run (formulation, κ, β, tolerance, load, mesh, order, error test); the
//! plan says which; each is measured, compared with a trusted solution of its `Physics` by
//! Radau IIA, and judged. Results go to a store as they come, so that the matrix can be interrupted.

mod cell;
mod maps;
mod measure;
mod plan;
mod report;
mod store;
mod verdict;
mod watch;

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::Context;
use clap::Args;
use myovib_fem::Mesh;
use myovib_model::advice::Advice;
use serde::Serialize;

use crate::args::CommonArgs;
use crate::error::InputError;
use crate::exit::Exit;
use crate::machine::Machine;
use crate::progress::Progress;
use crate::{atomic_file, interrupt, mesh_file, parallel};
use cell::{Cell, Physics, T_END};
use measure::{Measured, Trusted};
use store::Store;
use verdict::Verdict;

/// Options of `myovib stress`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib stress\n  \
    myovib stress --full --out stress-full --json stress.json\n\n\
    A run that ended is not repeated: the same command goes on where it was interrupted. Returns 0 \
    when every cell was recorded, whatever came of it.")]
pub struct StressArgs {
    /// All two-factor planes through the paper's points, not the quick subset.
    #[arg(long)]
    pub full: bool,

    /// Folder for results (`cells.jsonl`, `trusted.jsonl`, `stress.json`) and maps (SVG).
    #[arg(long, value_name = "DIR", default_value = "stress")]
    pub out: PathBuf,

    /// CPU seconds after which a run is stopped.
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    pub cap: f64,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// A cell with its result and what that is worth.
#[derive(Debug, Serialize)]
struct Row {
    #[serde(flatten)]
    cell: Cell,
    verdict: Verdict,
    #[serde(flatten)]
    measured: Measured,
    /// What the settings have to do with a wrong result.
    explanation: Option<String>,
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    t_end: f64,
    cap: f64,
    full: bool,
    rows: &'a [Row],
}

/// Runs the matrix.
///
/// # Errors
/// Wrong options, or a folder that cannot be written.
pub fn run(args: &StressArgs) -> anyhow::Result<Exit> {
    args.common.check()?;
    if !(args.cap > 0.0 && args.cap.is_finite()) {
        return Err(InputError::new("value out of range")
            .at("--cap")
            .found(args.cap)
            .allowed("a finite number above 0")
            .into());
    }
    let cells = if args.full {
        plan::full()
    } else {
        plan::quick()
    };
    let physics = physics_of(&cells);
    let n_threads = args.common.n_threads();
    if !args.common.quiet {
        let seconds = plan::estimate(&cells, args.cap) / n_threads.get() as f64;
        eprintln!(
            "{} cells, {} trusted solutions, on {n_threads} threads: about {:.0} min",
            cells.len(),
            physics.len(),
            (seconds / 60.0).ceil()
        );
    }
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    let (mesh, _) = mesh_file::load(None)?;
    let trusted = trusted_solutions(args, &physics, &mesh)?;
    let measured = measure_all(args, &cells, &trusted, &mesh)?;
    let rows = judged(&cells, measured, &mesh)?;

    maps::write_all(&rows, &args.out)?;
    let document = Document {
        machine: Machine::found(),
        t_end: T_END,
        cap: args.cap,
        full: args.full,
        rows: &rows,
    };
    let text = crate::json::document("stress", &document)?;
    atomic_file::write(&args.out.join("stress.json"), |file| {
        file.write_all(text.as_bytes())
    })?;
    args.common
        .give("stress", &report::text(&rows), &document)?;
    Ok(if rows.len() < cells.len() {
        Exit::Interrupted
    } else {
        Exit::Done
    })
}

/// What the cells have in common, once each.
fn physics_of(cells: &[Cell]) -> Vec<Physics> {
    let mut all: Vec<Physics> = Vec::new();
    for cell in cells {
        if !all.contains(&cell.physics) {
            all.push(cell.physics);
        }
    }
    all
}

/// The trusted solutions by the name of their physics; none where Radau IIA does not get through.
fn trusted_solutions(
    args: &StressArgs,
    physics: &[Physics],
    mesh: &Mesh,
) -> anyhow::Result<HashMap<String, Trusted>> {
    let store = Store::<Option<Trusted>>::open(&args.out.join("trusted.jsonl"))?;
    let found = each(args, "trusted solutions", physics, &store, |physics| {
        measure::trusted(physics, mesh, args.cap)
    })?;
    let named = physics.iter().zip(found);
    Ok(named
        .filter_map(|(physics, found)| Some((physics.to_string(), found??)))
        .collect())
}

fn measure_all(
    args: &StressArgs,
    cells: &[Cell],
    trusted: &HashMap<String, Trusted>,
    mesh: &Mesh,
) -> anyhow::Result<Vec<Option<Measured>>> {
    let store = Store::<Measured>::open(&args.out.join("cells.jsonl"))?;
    each(args, "cells", cells, &store, |cell| {
        let trusted = trusted.get(&cell.physics.to_string());
        measure::measure(cell, mesh, args.cap, trusted)
    })
}

/// `f` of each item on all threads, unless its result is in the store; none after an interruption.
fn each<I, T>(
    args: &StressArgs,
    what: &str,
    items: &[I],
    store: &Store<T>,
    f: impl Fn(&I) -> T + Sync,
) -> anyhow::Result<Vec<Option<T>>>
where
    I: Sync + ToString,
    T: Send + Sync + Clone + Serialize + serde::de::DeserializeOwned,
{
    let done = AtomicUsize::new(0);
    let progress = Mutex::new(Progress::new(args.common.quiet));
    let results = parallel::map(items, args.common.n_threads(), |item| {
        let key = item.to_string();
        let result = match store.get(&key) {
            Some(known) => Some(known.clone()),
            None if interrupt::flag().load(Ordering::Relaxed) => None,
            None => {
                let result = f(item);
                // What ran while the interruption came is no result.
                let whole = !interrupt::flag().load(Ordering::Relaxed);
                if whole {
                    store.append(&key, &result)?;
                }
                whole.then_some(result)
            }
        };
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Ok(mut progress) = progress.lock() {
            progress.show(|| format!("{what}: {done} of {}", items.len()));
        }
        Ok(result)
    });
    results.into_iter().collect()
}

/// Judges what was computed.
fn judged(
    cells: &[Cell],
    measured: Vec<Option<Measured>>,
    mesh: &Mesh,
) -> anyhow::Result<Vec<Row>> {
    let known: HashMap<String, &Measured> = cells
        .iter()
        .zip(&measured)
        .filter_map(|(cell, measured)| Some((cell.to_string(), measured.as_ref()?)))
        .collect();
    let verdicts: Vec<Option<Verdict>> = cells
        .iter()
        .map(|cell| {
            let row_1 = known.get(&cell.row_1().to_string()).copied();
            let own = known.get(&cell.to_string())?;
            Some(Verdict::of(own, row_1))
        })
        .collect();
    let mut rows = Vec::new();
    for ((cell, measured), verdict) in cells.iter().zip(measured).zip(verdicts) {
        let (Some(measured), Some(verdict)) = (measured, verdict) else {
            continue;
        };
        let explanation = match verdict {
            Verdict::Wrong => Some(explanation(cell, mesh)?),
            _ => None,
        };
        rows.push(Row {
            cell: *cell,
            verdict,
            measured,
            explanation,
        });
    }
    Ok(rows)
}

/// What the formulation and the settings of a cell make one expect.
fn explanation(cell: &Cell, mesh: &Mesh) -> anyhow::Result<String> {
    let muscle = cell.physics.muscle(mesh)?;
    let advice = Advice::new(&muscle, cell.formulation, &cell.settings());
    let findings: Vec<String> = advice.findings().iter().map(ToString::to_string).collect();
    Ok(if findings.is_empty() {
        "The settings are those advised: the tolerance is too loose for this load.".to_owned()
    } else {
        findings.join(" ")
    })
}

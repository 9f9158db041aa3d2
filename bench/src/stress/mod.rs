//! `myovib stress`: where each formulation breaks.
//!
//! Cast: a `Cell` is one run (formulation, κ, β, tolerance, load, mesh, order, error test); the
//! plan says which; each is measured, compared with a trusted solution of its `Physics` by
//! Radau IIA if it finished, and judged. Results go to a store as they come, so that the matrix can be
//! interrupted.

mod cell;
mod maps;
mod measure;
mod plan;
mod report;
mod store;
mod trusted;
mod verdict;
mod watch;

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::Context;
use clap::Args;
use myovib_fem::Mesh;
use myovib_model::advice::Advice;
use serde::Serialize;

use cell::{Cell, T_END};
use measure::{Ended, Measured, Run};
use myovib_cli::args::CommonArgs;
use myovib_cli::exit::Exit;
use myovib_cli::interrupt;
use myovib_cli::machine::Machine;
use myovib_cli::progress::Progress;
use myovib_cli::values;
use myovib_scene::atomic_file;
use myovib_scene::mesh_file;
use myovib_scene::parallel;
use store::{Origin, Store};
use trusted::{Errors, Solutions};
use verdict::Verdict;

/// Options of `myovib stress`.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    myovib-bench stress\n  \
    myovib-bench stress --full --out stress-full --json stress.json\n\n\
    A run that ended is not repeated: the same command goes on where it was interrupted. Returns 0 \
    when every cell was recorded, whatever came of it."
)]
pub(crate) struct StressArgs {
    /// All two-factor planes through the paper's points, not the quick subset.
    #[arg(long)]
    pub full: bool,

    /// Folder for results (`cells.jsonl`, `trusted.jsonl`, `stress.json`) and maps (SVG).
    #[arg(long, value_name = "DIR", default_value = "stress", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// CPU seconds after which a run is stopped.
    #[arg(long, value_name = "S", default_value_t = 20.0, value_parser = values::positive)]
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
    #[serde(flatten)]
    errors: Errors,
    /// What the settings have to do with a wrong result.
    explanation: Option<String>,
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    t_end: f64,
    cap: f64,
    full: bool,
    /// Cells of the matrix; fewer rows if it was interrupted.
    planned: usize,
    rows: &'a [Row],
}

/// Runs the matrix.
///
/// # Errors
/// Wrong options, or a folder that cannot be written.
pub(crate) fn run(args: &StressArgs) -> anyhow::Result<Exit> {
    let cells = if args.full {
        plan::full()
    } else {
        plan::quick()
    };
    let n_threads = args.common.n_threads();
    if !args.common.quiet {
        let seconds = plan::estimate(&cells, args.cap) / n_threads.get() as f64;
        eprintln!(
            "{} cells on {n_threads} threads: about {:.0} min",
            cells.len(),
            (seconds / 60.0).ceil()
        );
    }
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    let (mesh, _) = mesh_file::load(None)?;
    let origin = Origin::here(args.cap);
    let path = args.out.join("trusted.jsonl");
    let solutions = Solutions::open(&path, origin.clone(), &mesh, args.cap)?;
    let store = Store::open(&args.out.join("cells.jsonl"), origin)?;
    let runs = run_all(args, &cells, &store, &solutions)?;
    let rows = judged(&cells, runs, &solutions)?;

    maps::write_all(&rows, &args.out)?;
    let document = Document {
        machine: Machine::found(),
        t_end: T_END,
        cap: args.cap,
        full: args.full,
        planned: cells.len(),
        rows: &rows,
    };
    let text = myovib_scene::json::document("stress", &document)?;
    atomic_file::save(&args.out.join("stress.json"), text)?;
    args.common
        .give("stress", &report::text(&rows), &document)?;
    Ok(if rows.len() < cells.len() {
        Exit::Interrupted
    } else {
        Exit::Done
    })
}

/// Runs the cells on all threads, but for those in the store; those that finish ask for their trusted
/// solution. `None` for what an interruption has left out.
fn run_all(
    args: &StressArgs,
    cells: &[Cell],
    store: &Store<Run>,
    solutions: &Solutions<'_>,
) -> anyhow::Result<Vec<Option<Run>>> {
    let interrupted = || interrupt::flag().load(Ordering::Relaxed);
    let one = |cell: &Cell| {
        let key = cell.to_string();
        let run = match store.get(&key) {
            Some(known) => known.clone(),
            None if interrupted() => return Ok(None),
            None => {
                let run = measure::measure(cell, solutions.mesh(), args.cap);
                // What ran while the interruption came is no result.
                if interrupted() {
                    return Ok(None);
                }
                store.append(&key, &run)?;
                run
            }
        };
        if run.measured.ended == Ended::Finished && !interrupted() {
            solutions.ensure(&cell.physics)?;
        }
        Ok(Some(run))
    };
    let done = AtomicUsize::new(0);
    let progress = Progress::new(args.common.quiet);
    let runs = parallel::map(cells, args.common.n_threads(), |cell| {
        let run = one(cell);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.show(|| format!("{done} of {} cells", cells.len()));
        run
    });
    runs.into_iter().collect()
}

/// Judges what was run.
fn judged(
    cells: &[Cell],
    runs: Vec<Option<Run>>,
    solutions: &Solutions<'_>,
) -> anyhow::Result<Vec<Row>> {
    let run: Vec<(&Cell, Run, Errors)> = cells
        .iter()
        .zip(runs)
        .filter_map(|(cell, run)| Some((cell, run?)))
        .map(|(cell, run)| {
            let errors = Errors::of(&run, solutions.known(&cell.physics).as_ref());
            (cell, run, errors)
        })
        .collect();
    let finished = run
        .iter()
        .filter(|(_, run, _)| run.measured.ended == Ended::Finished);
    let error_of: HashMap<String, f64> = finished
        .filter_map(|(cell, _, errors)| Some((cell.to_string(), errors.error_u_y?)))
        .collect();
    run.into_iter()
        .map(|(cell, run, errors)| {
            let row_1 = error_of.get(&cell.row_1().to_string()).copied();
            let verdict = Verdict::of(cell, run.measured.ended, &errors, row_1);
            let explanation = match verdict {
                Verdict::Wrong => Some(explanation(cell, solutions.mesh())?),
                _ => None,
            };
            Ok(Row {
                cell: *cell,
                verdict,
                measured: run.measured,
                errors,
                explanation,
            })
        })
        .collect()
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

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use myovib_model::Formulation;

    use super::*;

    #[test]
    fn a_cell_gives_the_same_bits_whatever_the_threads() {
        let (mesh, _) = mesh_file::load(None).unwrap();
        let cells = [
            Formulation::Position,
            Formulation::Velocity,
            Formulation::Rate,
        ]
        .map(|f| {
            let home = Cell::home(f, f64::INFINITY);
            Cell { rtol: 1e-2, ..home }
        });
        let runs = |n_threads| {
            let n_threads = NonZeroUsize::new(n_threads).unwrap();
            let runs = parallel::map(&cells, n_threads, |cell| {
                let mut run = measure::measure(cell, &mesh, 20.0);
                run.measured.cpu_seconds = 0.0;
                run.measured.wall_seconds = 0.0;
                run
            });
            serde_json::to_value(runs).unwrap()
        };
        let one = runs(1);
        assert_eq!(one[0]["measured"]["outcome"], "finished");
        assert_eq!(one, runs(2));
    }
}

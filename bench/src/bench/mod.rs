//! `myovib-bench bench`: measures the cost of linear solvers, chains, responses and large bodies.

mod chains;
mod large;
mod response;
mod rows;
mod text;

use std::sync::atomic::Ordering;

use anyhow::Context;
use clap::{Args, ValueEnum};
use cpu_time::ThreadTime;
use serde::Serialize;
use serde_json::Value;

use myovib_cli::args::CommonArgs;
use myovib_cli::exit::Exit;
use myovib_cli::interrupt;
use myovib_cli::values;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::{InputError, Scene};

/// Options of `myovib-bench bench`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib-bench bench rows --repeats 3 --json=rows.json\n  \
    myovib-bench bench large --cases spindle-bdf,growth\n\n\
    CPU times are for one thread; compare only times from the same invocation. After Ctrl-C, the current run \
    finishes, and the results so far are printed.")]
pub(crate) struct BenchArgs {
    /// Measurement to run
    #[arg(value_enum, default_value = "rows")]
    pub what: What,

    /// Cases of `large`: ventricle-bdf, ventricle-radau5, spindle-bdf, spindle-radau5, growth [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub cases: Vec<String>,

    /// End time of `rows` in s
    #[arg(long, value_name = "T", value_parser = values::positive)]
    pub t_end: Option<f64>,

    /// Number of runs of each case; the fastest is reported
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub repeats: u32,

    /// Options of all commands
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum What {
    /// Rows of Table 2 with the condensed, the full and SUNDIALS' default linear solver
    Rows,
    /// Harmonic responses versus time integration and separate factorizations, adaptive versus equidistant frequencies,
    /// and a periodic state versus time integration from rest
    Response,
    /// Runs without chains, with chains integrated by separate steps, and with body and chains as one system
    Chains,
    /// Twenty time steps of bodies with 100 000 unknowns, and the cost of 10 000 to 200 000 unknowns
    Large,
}

impl BenchArgs {
    /// Rejects options that do not apply to the measurement.
    fn check(&self) -> Result<(), InputError> {
        let options = [
            ("--cases", !self.cases.is_empty(), What::Large, "bench large"),
            ("--t-end", self.t_end.is_some(), What::Rows, "bench rows"),
        ];
        match options.into_iter().find(|(_, given, what, _)| *given && self.what != *what) {
            Some((option, .., allowed)) => {
                Err(InputError::new("the option does not apply to this measurement")
                    .at(option)
                    .allowed(allowed))
            }
            None => Ok(()),
        }
    }
}

/// Returns whether to continue, which is false after Ctrl-C. It is called between runs.
fn goes_on() -> bool {
    !interrupt::flag().load(Ordering::Relaxed)
}

/// Runs `repeats` times and returns the fastest run. `seconds` returns the time of a run.
fn fastest<T>(
    repeats: u32,
    mut run: impl FnMut() -> anyhow::Result<T>,
    seconds: impl Fn(&T) -> f64,
) -> anyhow::Result<T> {
    let mut fastest = run()?;
    for _ in 1..repeats {
        if !goes_on() {
            break;
        }
        let next = run()?;
        if seconds(&next) < seconds(&fastest) {
            fastest = next;
        }
    }
    Ok(fastest)
}

/// Returns the CPU time (s) of the fastest of `repeats` calls.
fn fastest_call<E>(repeats: u32, mut call: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let mut best = f64::INFINITY;
    for _ in 0..repeats.max(1) {
        let start = ThreadTime::now();
        call()?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}

/// Computes a scene `repeats` times. Returns the document of the fastest run and its CPU time (s).
fn fastest_document(scene: &Scene, repeats: u32) -> anyhow::Result<(Value, f64)> {
    let once = || -> anyhow::Result<_> {
        let folder = tempfile::tempdir()?;
        let document = compute(scene, &RunOptions::into_folder(folder.path()))?.document;
        let seconds = document["cpu_seconds"].as_f64().context("a run has a CPU time")?;
        Ok((document, seconds))
    };
    fastest(repeats, once, |(_, seconds)| *seconds)
}

/// Prints or writes the results. They are incomplete after Ctrl-C.
fn give(args: &BenchArgs, document: &impl Serialize) -> anyhow::Result<Exit> {
    let is_complete = goes_on();
    let mut text = text::text(&serde_json::to_value(document)?);
    if !is_complete {
        text += "\nInterrupted: the results are incomplete.\n";
    }
    args.common.print_or_write("bench", &text, document)?;
    Ok(if is_complete { Exit::Done } else { Exit::Interrupted })
}

/// Runs the benchmark.
///
/// # Errors
/// Fails if options are invalid or if the results cannot be written. A failed run is not an error: it is a row in the
/// results.
pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<Exit> {
    args.check()?;
    // From here on, Ctrl-C only sets a flag.
    interrupt::install();
    interrupt::flag();
    match args.what {
        What::Rows => rows::run(args),
        What::Response => response::run(args),
        What::Chains => chains::run(args),
        What::Large => large::run(args),
    }
}

//! `myovib bench`: what accuracy costs, what features cost, how costs grow.

mod accuracy;
mod cases;
mod features;
mod growth;
mod large;
mod reference;
mod rival;
mod rows;
mod work;

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::{Args, ValueEnum};
use serde::Serialize;

use myovib_cli::args::CommonArgs;
use myovib_cli::exit::Exit;
use myovib_cli::interrupt;
use myovib_cli::values;
use myovib_scene::InputError;
use myovib_scene::mesh_file;

/// Options of `myovib bench`.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    myovib-bench bench --svg work.svg --json work.json\n  \
    myovib-bench bench --cases incompressible --tolerances 1e-3,1e-4,1e-5\n  \
    myovib-bench bench accuracy --repeats 3\n  \
    myovib-bench bench features\n  \
    myovib-bench bench growth --refinements 3\n  \
    myovib-bench bench large --cases spindle-bdf,growth\n  \
    myovib-bench bench rows --repeats 3\n\n\
    CPU times are those of one thread; compare them within one run. After Ctrl-C the run that is being \
    timed ends, and what was measured is given."
)]
pub(crate) struct BenchArgs {
    /// What to measure.
    #[arg(value_enum, default_value = "work")]
    pub what: What,

    /// Cases to run: undamped, damped, incompressible, damped-incompressible, displacement; of `large`:
    /// ventricle-bdf, ventricle-radau, spindle-bdf, spindle-radau, growth.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub cases: Vec<String>,

    /// Relative tolerances; the absolute ones follow in proportion to the paper's.
    #[arg(long, value_name = "X", value_delimiter = ',', value_parser = values::relative_tolerance,
          default_values_t = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])]
    pub tolerances: Vec<f64>,

    /// End time in s, at most that of the references.
    #[arg(long, value_name = "T", value_parser = values::positive)]
    pub t_end: Option<f64>,

    /// Runs of each point; the fastest counts.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub repeats: u32,

    /// CPU seconds a run may take before it counts as failed.
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = values::positive)]
    pub cap: f64,

    /// Uniform refinements of the mesh in `growth`.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(..=6))]
    pub refinements: u32,

    /// Folder of the reference trajectories [default: those built in].
    #[arg(long, value_name = "DIR")]
    pub references: Option<PathBuf>,

    /// Compute the references anew with Radau IIA, into the folder of `--references`.
    #[arg(long, requires = "references")]
    pub write_references: bool,

    /// Points of an integrator that is not ours, for `work`: as the package `bench/` writes them.
    #[arg(long, value_name = "FILE")]
    pub rival: Option<PathBuf>,

    /// Draw the diagram of work and precision.
    #[arg(long, value_name = "FILE", value_parser = values::output_file)]
    pub svg: Option<PathBuf>,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum What {
    /// Work against precision, for formulations and integrators.
    Work,
    /// CPU time that each way needs for given accuracies of u_y at the origin, up to t = 10 s.
    Accuracy,
    /// Time of a residual and of a run as features are switched on one by one.
    Features,
    /// Time, memory and fill on refined meshes.
    Growth,
    /// Twenty steps of bodies of 100 000 unknowns, and costs from 10 000 to 200 000.
    Large,
    /// Rows of Table 2 with the condensed, the full and SUNDIALS' own linear solver.
    Rows,
}

impl BenchArgs {
    /// Options that have nothing to say to this measurement are refused.
    fn check(&self) -> Result<(), InputError> {
        let (work, cases) = match self.what {
            What::Work => (true, true),
            What::Accuracy | What::Large => (false, true),
            What::Features | What::Growth | What::Rows => (false, false),
        };
        let options = [
            ("--cases", !self.cases.is_empty(), cases),
            ("--references", self.references.is_some(), work),
            ("--rival", self.rival.is_some(), work),
            ("--svg", self.svg.is_some(), work),
        ];
        if let Some((option, ..)) = options.into_iter().find(|(_, given, has)| *given && !has) {
            let error = InputError::new("the option has no meaning for this measurement");
            return Err(error.at(option).allowed(match option {
                "--cases" => "bench work, bench accuracy, bench large",
                _ => "bench work",
            }));
        }
        // Errors are found at samples; that at t = 0 has none.
        match self.t_end {
            Some(t_end) if cases && t_end < reference::EVERY => {
                let error = InputError::new("value out of range").at("--t-end");
                let allowed = format!("{} at least (s)", reference::EVERY);
                Err(error.found(t_end).allowed(allowed))
            }
            _ => Ok(()),
        }
    }
}

/// Whether to measure on: not after a Ctrl-C, which is looked for between two runs.
fn goes_on() -> bool {
    !interrupt::flag().load(Ordering::Relaxed)
}

/// The fastest of so many runs, each of which takes `seconds`.
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

/// Gives what was measured, all of it or what came before a Ctrl-C.
fn give(args: &BenchArgs, text: &str, document: &impl Serialize) -> anyhow::Result<Exit> {
    if goes_on() {
        args.common.give("bench", text, document)?;
        return Ok(Exit::Done);
    }
    let text = format!("{text}\nInterrupted: there is more to measure.\n");
    args.common.give("bench", &text, document)?;
    Ok(Exit::Interrupted)
}

/// Runs the benchmark.
///
/// # Errors
/// Wrong options, or an output that cannot be written. A run that fails is a row.
pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<Exit> {
    args.check()?;
    // From here on a Ctrl-C is waited for.
    interrupt::flag();
    let (mesh, _) = mesh_file::load(None)?;
    match args.what {
        What::Work if args.write_references => reference::write_all(args, &mesh),
        What::Work => work::run(args, &mesh),
        What::Accuracy => accuracy::run(args, &mesh),
        What::Features => features::run(args, &mesh),
        What::Growth => growth::run(args, &mesh),
        What::Large => large::run(args),
        What::Rows => rows::run(args),
    }
}

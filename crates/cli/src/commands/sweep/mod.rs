//! `myovib sweep`: runs one scene for all combinations of given values, with a folder for each case.

mod slurm;

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use myovib_report::{page, sweep};
use myovib_scene::plain;
use myovib_scene::sweep::{Cases, SweepOptions, compute};

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::interrupt;
use crate::output;
use crate::progress::Progress;
use crate::values;

/// Options of `myovib sweep`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib sweep scene.toml --vary solid.bulk_modulus=1e4,1e5,inf --out moduli\n  \
    myovib sweep scene.toml --vary solid.rayleigh_stiffness=1e-5..1e-3:5 --vary solid.bulk_modulus=1e5,inf\n  \
    myovib sweep scene.toml --vary solid.rayleigh_stiffness=1e-5..1e-2:4:log --result 'gain=amplitude(origin.u_y, 1)/1e-3'\n  \
    myovib sweep scene.toml --vary solid.bulk_modulus=1e4,1e5,inf --case 2/3\n  \
    myovib sweep scene.toml --vary solid.bulk_modulus=1e4..1e6:12:log --slurm jobs.sh --per-task 2\n\n\
    A range lo..hi:n has n equally spaced values from lo to hi; with :log, their logarithms are equally spaced.\n\n\
    The scenes of all cases are read before any case is computed: an invalid value is an error. The table, with a \
    row for each case, goes to standard output and to sweep.csv and sweep.json in the folder, and report.html shows \
    it with the curves. A case that fails during its run becomes a row with its message. Repeating the command \
    computes only missing cases: those that failed, and those whose scene, mesh, tables or program have changed.\n\n\
    The exit code is 0 if every case was recorded, including failed ones.")]
pub struct SweepArgs {
    /// Scene: a TOML file or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Values of a key of the scene: key=a,b,c, or key=lo..hi:n, or key=lo..hi:n:log. With several
    /// keys, all combinations are cases; the last key changes fastest.
    #[arg(long, value_name = "KEY=VALUES", required = true)]
    pub vary: Vec<String>,

    /// Change a value of the scene in all cases; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Add a column to the table, computed from probe data: an expression of min(PROBE.COLUMN),
    /// max, mean, last or amplitude (half the range), over the whole run or from a given time, for
    /// example 'gain=amplitude(tip.u_y, 1.5)/1e-3'. May be repeated.
    #[arg(long, value_name = "NAME=EXPRESSION")]
    pub result: Vec<String>,

    /// Folder for the table and the cases (case-0001 and so on, each a run folder).
    #[arg(long, value_name = "DIR", default_value = "sweep", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Start the search for each equilibrium from the case with the preceding value of the last key instead of the
    /// unloaded body. This takes fewer iterations and stays on one branch of equilibria.
    #[arg(long, conflicts_with = "slurm")]
    pub from_neighbor: bool,

    /// Recompute all cases and replace another sweep in the folder.
    #[arg(long)]
    pub overwrite: bool,

    /// Compute only case K of N, or cases K to L of N (counted from 1). N must be the number of cases.
    #[arg(long, value_name = "K[-L]/N")]
    pub case: Option<String>,

    /// Write the table of the computed cases without computing any.
    #[arg(long, conflicts_with_all = ["case", "overwrite"])]
    pub collect: bool,

    /// Write a Slurm job script that computes the cases as an array, without computing any.
    #[arg(long, value_name = "FILE", value_parser = values::output_file, conflicts_with_all = ["case", "collect", "overwrite"])]
    pub slurm: Option<PathBuf>,

    /// Number of cases that each task of the job script computes in sequence.
    #[arg(long, value_name = "N", default_value = "1", requires = "slurm", value_parser = values::up_to::<100_000>)]
    pub per_task: NonZeroUsize,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Runs the cases. A case that fails during the computation is reported as a row of the table.
pub fn run(args: &SweepArgs) -> anyhow::Result<Exit> {
    if let Some(file) = &args.slurm {
        let jobs = slurm::write(args, file)?;
        args.common.print_or_write("sweep", &jobs.text(), &jobs)?;
        return Ok(Exit::Done);
    }
    let progress = Progress::new(args.common.quiet);
    let result = compute(&SweepOptions {
        scene: args.scene.clone(),
        vary: args.vary.clone(),
        set: args.set.clone(),
        out: args.out.clone(),
        results: args.result.clone(),
        cases: match &args.case {
            _ if args.collect => Cases::None,
            Some(case) => Cases::Some(case.clone()),
            None => Cases::All,
        },
        overwrite: args.overwrite,
        from_neighbor: args.from_neighbor,
        n_threads: args.common.n_threads(),
        interrupt: Some(interrupt::flag()),
        progress: &progress,
        finished: &page::write_case,
    })?;
    drop(progress);
    sweep::write(&args.out, &result)?;
    print_notes(&result.stopped);
    print_notes(&result.notes);
    args.common.print_or_write("sweep", &plain(&result.csv), &result.document)?;
    Ok(if interrupt::is_interrupted() {
        Exit::Interrupted
    } else if result.failed_to_write {
        Exit::Failed
    } else {
        Exit::Done
    })
}

/// Maximum number of cases listed in a note.
const MAX_LISTED: usize = 10;

fn print_notes(cases: &[String]) {
    for case in cases.iter().take(MAX_LISTED) {
        output::note(case);
    }
    if cases.len() > MAX_LISTED {
        let more = cases.len() - MAX_LISTED;
        output::note(&format!("{more} more; run.json of each case contains its notes"));
    }
}

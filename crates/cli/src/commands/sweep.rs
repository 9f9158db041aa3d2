//! `myovib sweep`: one scene over a grid of values, a folder for each case.

use std::path::PathBuf;

use clap::Args;
use myovib_report::page;
use myovib_scene::sweep::{SweepOptions, compute};

use crate::args::{self, CommonArgs};
use crate::exit::Exit;
use crate::interrupt;
use crate::progress::Progress;

/// Options of `myovib sweep`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib sweep scene.toml --vary solid.kappa=1e4,1e5,inf --out kappa\n  \
    myovib sweep scene.toml --vary solid.beta=1e-5..1e-3:5 --vary solid.kappa=1e5,inf\n  \
    myovib sweep scene.toml --vary solid.kappa=1e4,1e5,inf --case 2/3\n\n\
    A range lo..hi:n has n values, equally spaced. Finished cases are not computed again, \
    unless the scene, a file that it reads or the program has changed. Returns 0 when every case was recorded, also those that failed.")]
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

    /// Compute all cases again, also those that were computed.
    #[arg(long)]
    pub overwrite: bool,

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
    let progress = Progress::new(args.common.quiet);
    let result = compute(&SweepOptions {
        scene: args.scene.clone(),
        vary: args.vary.clone(),
        set: args.set.clone(),
        out: args.out.clone(),
        case: args.case.clone(),
        overwrite: args.overwrite,
        n_threads: args.common.n_threads(),
        interrupt: Some(interrupt::flag()),
        progress: &progress,
        finished: &|folder, scene, result| page::write(folder, scene, &result.document),
    })?;
    drop(progress);
    args.common.give("sweep", &result.csv, &result.document)?;
    Ok(if interrupt::has_come() {
        Exit::Interrupted
    } else {
        Exit::Done
    })
}

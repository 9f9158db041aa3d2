//! `myovib periodic`: periodic state of a scene and its stability.

use std::path::PathBuf;

use clap::Args;
use myovib_scene::run::Existing;

use crate::args::CommonArgs;
use crate::commands::run::{self, Request};
use crate::exit::Exit;
use crate::overrides;
use crate::values;

/// Options of `myovib periodic`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib periodic scene.toml\n  \
    myovib periodic scene.toml --set periodic.frequency=4\n  \
    myovib periodic scene.toml --set periodic.settling_periods=20 --set periodic.multipliers=8\n  \
    myovib periodic scene.toml --continue traction[0].y.frequency=5..15\n\n\
    Finds the motion that repeats with the period of the loads, without computing the transient, by Newton's method \
    for a state that recurs after one period. The search starts from harmonic balance if the motion is nearly linear, \
    or from the motion after periodic.settling_periods periods. The largest Floquet multipliers show whether the \
    motion is stable. Writes NAME.csv for each [[probe]] over one period; run.json with multipliers and harmonics; \
    state.json, from which a motion can start; and report.html. --continue also writes continuation.csv: amplitudes \
    of the first harmonics and stability along the curve.")]
pub struct PeriodicArgs {
    /// The scene: a TOML file, or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Follow the branch of periodic states as a value of the scene varies, including through folds.
    #[arg(long = "continue", value_name = "KEY=FROM..TO", value_parser = values::key_and_range)]
    pub continued: Option<(String, [f64; 2])>,

    /// Change a value of the scene; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Folder for the results; created if missing. It must not contain results.
    #[arg(long, value_name = "DIR", default_value = "periodic", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Replace the results in the folder.
    #[arg(long)]
    pub overwrite: bool,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Computes the periodic state.
pub fn run(args: &PeriodicArgs) -> anyhow::Result<Exit> {
    let mut set = args.set.clone();
    let mut own = vec![("analysis=periodic".to_owned(), "this command")];
    if let Some((key, [from, to])) = &args.continued {
        let changes = [
            format!("{key}={from:?}"),
            format!("periodic.continuation.parameter={key:?}"),
            format!("periodic.continuation.to={to:?}"),
        ];
        own.extend(changes.map(|change| (change, "--continue")));
    }
    overrides::expect_free(&set, &own)?;
    set.extend(own.into_iter().map(|(change, _)| change));
    let scene = run::load(&args.scene, &set)?;
    let request = Request {
        command: "periodic",
        out: &args.out,
        existing: Existing::of(false, args.overwrite),
        verify: false,
        common: &args.common,
    };
    request.compute(&scene)
}

//! `myovib response`: harmonic response of a scene as a function of frequency.

use std::path::PathBuf;

use clap::Args;
use myovib_scene::run::Existing;

use crate::args::CommonArgs;
use crate::commands::run::{self, Request};
use crate::exit::Exit;
use crate::overrides;
use crate::values;

/// Options of `myovib response`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib response scene.toml --frequencies 1..60:adaptive\n  \
    myovib response scene.toml --frequencies 1..60:120\n  \
    myovib response scene.toml --frequencies 0.1..100:60:log --threads 4\n  \
    myovib response scene.toml --set response.preload_time=2\n\n\
    Computes the small harmonic motion about rest, or about the equilibrium under the loads at \
    response.preload_time. Loads and displacements with a `response` in the scene drive the body. Writes \
    NAME.csv for each [[probe]]: frequency, then real part, imaginary part, amplitude and phase (degrees) of \
    each value; run.json; and report.html with amplitude and phase over frequency.")]
pub struct ResponseArgs {
    /// The scene: a TOML file, or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Frequencies in Hz: LOW..HIGH:N, LOW..HIGH:N:log, LOW..HIGH:adaptive, or a list A,B,C [default: from the scene].
    #[arg(long, allow_hyphen_values = true, value_name = "LIST")]
    pub frequencies: Option<String>,

    /// Change a value of the scene; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Folder for the results; created if missing. It must not contain results.
    #[arg(long, value_name = "DIR", default_value = "response", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Replace the results in the folder.
    #[arg(long)]
    pub overwrite: bool,

    #[command(flatten)]
    pub common: CommonArgs,
}

pub fn run(args: &ResponseArgs) -> anyhow::Result<Exit> {
    let mut set = args.set.clone();
    let frequencies = args.frequencies.iter();
    let frequencies =
        frequencies.map(|list| (format!("response.frequencies=\"{list}\""), "--frequencies"));
    let own: Vec<_> =
        frequencies.chain([("analysis=response".to_owned(), "this command")]).collect();
    overrides::expect_free(&set, &own)?;
    set.extend(own.into_iter().map(|(change, _)| change));
    let scene = run::load(&args.scene, &set)?;
    let request = Request {
        command: "response",
        out: &args.out,
        existing: Existing::of(false, args.overwrite),
        verify: false,
        common: &args.common,
    };
    request.compute(&scene)
}

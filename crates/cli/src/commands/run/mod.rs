//! `myovib run`: computes a scene and writes what it asks for.
//!
//! Order: the scene is made whole ([`Scene`]), then the folder is prepared, then the integrator
//! runs with the outputs looking at each accepted step, and at the end `run.json` and
//! `report.html` say what happened.

mod checkpoint;
mod document;
mod dynamic;
mod energy;
mod folder;
mod html;
mod outputs;
mod recorder;
mod start;
mod statics;
mod stop;
mod system;

use std::path::PathBuf;

use clap::Args;

use crate::args::{self, CommonArgs};
use crate::error::InputError;
use crate::exit::Exit;
use crate::scene::Scene;
use crate::scene_file::Analysis;

/// Options of `myovib run`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib run scene.toml\n  \
    myovib run scene.toml --resume\n  \
    myovib run scene.toml --out soft --set 'material[0].c10=5e3' --set time.end=0.5\n\n\
    Writes NAME.csv for each probe, fields.pvd with VTU files, run.json and report.html.")]
pub struct RunArgs {
    /// The scene: a TOML file, or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Folder for the results; it must not hold a run already.
    #[arg(long, value_name = "DIR", default_value = "out", value_parser = args::output_folder)]
    pub out: PathBuf,

    /// Change a value of the scene, as in `solid.kappa=inf` or `material[0].c10=2e4`; may be
    /// repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Go on from the last checkpoint in the folder.
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,

    /// Replace a run that the folder holds already.
    #[arg(long)]
    pub overwrite: bool,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Computes the scene.
///
/// # Errors
/// A wrong scene (before anything is written), or an output that cannot be written.
pub fn run(args: &RunArgs) -> anyhow::Result<Exit> {
    let scene = Scene::load(&args.scene, &args.set)?;
    for note in scene.notes() {
        eprintln!("note: {note}");
    }
    let result = compute(&scene, args)?;
    args.common
        .give("run", &document::text(&result.document), &result.document)?;
    Ok(result.exit)
}

/// What a run came to, and how the program ends.
pub(crate) struct RunResult {
    /// The body of `run.json`.
    pub(crate) document: serde_json::Value,
    /// The exit code.
    pub(crate) exit: Exit,
}

/// Computes a scene into its folder.
pub(crate) fn compute(scene: &Scene, args: &RunArgs) -> anyhow::Result<RunResult> {
    match scene.file.analysis {
        Analysis::Dynamic => dynamic::compute(scene, args),
        Analysis::Static => statics::compute(scene, args),
        Analysis::Modes => Err(InputError::new(
            "the scene asks for modes, which `run` does not do",
        )
        .next(format!("myovib modes {}", args.scene.display()))
        .into()),
    }
}

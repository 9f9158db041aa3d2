//! `myovib scenes`: lists the built-in scenes.

use clap::Args;
use myovib_report::table::{Align, Table, colored_stdout};
use myovib_scene::builtin::SCENES;
use serde_json::json;

use crate::exit::Exit;
use crate::json::JsonTarget;
use crate::{json, output};

/// Options of `myovib scenes`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  myovib scenes\n  myovib scenes --json\n  myovib run land1\n  \
                        myovib init --from land1"
)]
pub struct ScenesArgs {
    /// Print JSON instead of the table, or write it to FILE.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<JsonTarget>,
}

/// Prints the name, the run time and the title of each scene.
pub fn run(args: &ScenesArgs) -> anyhow::Result<Exit> {
    if let Some(target) = &args.json {
        let scenes = SCENES.iter().map(|scene| {
            json!({ "name": scene.name, "run_time": scene.run_time, "title": scene.title() })
        });
        let scenes: Vec<_> = scenes.collect();
        json::write(target, "scenes", &json!({ "scenes": scenes }))?;
        return Ok(Exit::Done);
    }
    let mut table =
        Table::new(&[("scene", Align::Left), ("run time", Align::Left), ("title", Align::Left)]);
    for scene in SCENES {
        table.row(vec![scene.name.into(), scene.run_time.into(), scene.title().into()]);
    }
    output::print(table.render(colored_stdout()))?;
    Ok(Exit::Done)
}

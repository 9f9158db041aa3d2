//! `myovib schema`: the JSON Schema of scenes.

use clap::Args;

use crate::exit::Exit;
use crate::output;
use myovib_scene::scene_file;

/// Options of `myovib schema`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  myovib schema > scene.schema.json\n\nEditors with a TOML \
                        language server check a scene that starts with the line\n  \
                        #:schema ./scene.schema.json")]
pub struct SchemaArgs {
    /// Print the scene reference of the guide as Markdown instead.
    #[arg(long)]
    pub markdown: bool,
}

pub fn run(args: &SchemaArgs) -> anyhow::Result<Exit> {
    let text = if args.markdown {
        scene_file::reference()
    } else {
        serde_json::to_string_pretty(&scene_file::schema())? + "\n"
    };
    output::print(text)?;
    Ok(Exit::Done)
}

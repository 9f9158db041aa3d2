//! `myovib schema`: the JSON Schema of scenes.

use clap::Args;

use crate::exit::Exit;
use crate::scene_file;

/// Options of `myovib schema`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  myovib schema > scene.schema.json\n\nEditors with a TOML \
                        language server check a scene that starts with the line\n  \
                        #:schema ./scene.schema.json"
)]
pub struct SchemaArgs {}

/// Prints the schema.
///
/// # Errors
/// When standard output cannot be written.
pub fn run(_: &SchemaArgs) -> anyhow::Result<Exit> {
    let text = serde_json::to_string_pretty(&scene_file::schema())?;
    println!("{text}");
    Ok(Exit::Done)
}

//! Output of JSON documents.

use std::path::PathBuf;
use std::str::FromStr;

use myovib_scene::json::document;
use serde::Serialize;

use crate::output;
use crate::values::output_file;

/// Target of a JSON document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JsonTarget {
    /// Standard output.
    Stdout,
    /// A file.
    File(PathBuf),
}

impl FromStr for JsonTarget {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "-" => Ok(Self::Stdout),
            path => output_file(path).map(Self::File),
        }
    }
}

/// Writes the document of `command` to standard output or atomically to a file.
pub fn write(target: &JsonTarget, command: &str, body: &impl Serialize) -> anyhow::Result<()> {
    let text = document(command, body)?;
    match target {
        JsonTarget::Stdout => output::print(text)?,
        JsonTarget::File(path) => output::save(path, text)?,
    }
    Ok(())
}

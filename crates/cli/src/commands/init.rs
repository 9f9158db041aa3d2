//! `myovib init`: writes a commented scene to start from.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use crate::exit::Exit;
use crate::output;
use myovib_scene::{InputError, builtin_text};

/// Returns the template scene, which runs without changes.
fn scene() -> &'static str {
    builtin_text("init").expect("a built-in scene")
}

/// Options of `myovib init`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  myovib init\n  myovib init leg.toml\n  myovib init - | less")]
pub struct InitArgs {
    /// Output file; `-` is standard output. An existing file is not overwritten.
    #[arg(default_value = "scene.toml", value_name = "FILE")]
    pub file: PathBuf,
}

/// Writes the scene.
///
/// # Errors
/// Returns an error if the file exists or cannot be written.
pub fn run(args: &InitArgs) -> anyhow::Result<Exit> {
    if args.file.as_os_str() == "-" {
        output::print(scene())?;
        return Ok(Exit::Done);
    }
    let name = args.file.display();
    let mut file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&args.file)
        .map_err(|error| {
            if error.kind() == io::ErrorKind::AlreadyExists {
                InputError::new(format!("{name} exists and was not changed"))
                    .next("give another name: myovib init other.toml")
                    .into()
            } else {
                anyhow::Error::from(error).context(format!("cannot write {name}"))
            }
        })?;
    file.write_all(scene().as_bytes())
        .with_context(|| format!("cannot write {name}"))?;
    output::print(format!(
        "{name} written. Next:\n  myovib check {name}\n  myovib run {name} --out out\n"
    ))?;
    Ok(Exit::Done)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_existing_file_is_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.toml");
        run(&InitArgs { file: file.clone() }).unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), scene());
        std::fs::write(&file, "mine").unwrap();
        let failure = run(&InitArgs { file: file.clone() }).unwrap_err();
        assert!(
            failure.to_string().contains("is left as it is"),
            "{failure}"
        );
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
    }
}

//! `myovib init`: writes a built-in scene, or a commented scene as a starting point.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use crate::exit::Exit;
use crate::output;
use myovib_scene::{InputError, builtin};

/// Options of `myovib init`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  myovib init\n  myovib init leg.toml\n  myovib init - | less\n  \
                  myovib init --from land1 beam.toml\n  myovib init --from ventricle --mesh\n\n\
                  `myovib scenes` lists the built-in scenes."
)]
pub struct InitArgs {
    /// Path of the new scene; `-` is standard output. An existing file is not replaced [default:
    /// scene.toml, or NAME.toml with --from].
    #[arg(value_name = "FILE")]
    pub file: Option<PathBuf>,

    /// Write this built-in scene instead of the template.
    #[arg(long, value_name = "NAME")]
    pub from: Option<String>,

    /// Also write the mesh file of the built-in scene, next to it.
    #[arg(long, requires = "from")]
    pub mesh: bool,
}

/// Writes the scene.
pub fn run(args: &InitArgs) -> anyhow::Result<Exit> {
    let name = args.from.as_deref().unwrap_or("init");
    let scene = builtin::find(name)?;
    let default = match &args.from {
        Some(name) => format!("{name}.toml"),
        None => "scene.toml".to_owned(),
    };
    let path = args.file.clone().unwrap_or_else(|| default.into());
    let mesh = match args.mesh {
        true => Some(scene.mesh_file()?),
        false => None,
    };
    if path.as_os_str() == "-" {
        if args.mesh {
            let error =
                InputError::new("cannot write a mesh file when the scene goes to standard output");
            return Err(error.next("name a FILE for the scene, or remove `--mesh`").into());
        }
        output::print(scene.text)?;
        return Ok(Exit::Done);
    }
    create(&path, scene.text)?;
    let file = path.display();
    let mut next = format!("{file} written.");
    if let Some((name, text)) = mesh {
        let beside = path.with_file_name(name);
        create(&beside, text)?;
        next += &format!(
            " {} written; to use it: [mesh] type = \"file\", path = \"{name}\".",
            beside.display()
        );
    }
    output::print(format!("{next} Next:\n  myovib check {file}\n  myovib run {file} --out out\n"))?;
    Ok(Exit::Done)
}

/// Writes a new file.
fn create(path: &Path, text: &str) -> anyhow::Result<()> {
    let name = path.display();
    let mut file = OpenOptions::new().write(true).create_new(true).open(path).map_err(|error| {
        if error.kind() == io::ErrorKind::AlreadyExists {
            InputError::new(format!("`{name}` already exists and is not replaced"))
                .next("choose another name: myovib init other.toml")
                .into()
        } else {
            anyhow::Error::from(error).context(format!("cannot write {name}"))
        }
    })?;
    file.write_all(text.as_bytes()).with_context(|| format!("cannot write {name}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn init(file: &Path, from: Option<&str>, mesh: bool) -> anyhow::Result<Exit> {
        run(&InitArgs { file: Some(file.to_owned()), from: from.map(str::to_owned), mesh })
    }

    #[test]
    fn existing_files_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.toml");
        init(&file, None, false).unwrap();
        let template = builtin::find("init").unwrap().text;
        assert_eq!(std::fs::read_to_string(&file).unwrap(), template);
        std::fs::write(&file, "mine").unwrap();
        let failure = init(&file, None, false).unwrap_err();
        assert!(failure.is::<InputError>(), "{failure}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
    }

    /// Checks that each built-in scene can be written to a folder together with its mesh file and read again.
    #[test]
    fn every_built_in_scene_can_be_written_and_read() {
        for scene in builtin::SCENES {
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("copy.toml");
            init(&file, Some(scene.name), scene.mesh_file().is_ok()).unwrap();
            let text = std::fs::read_to_string(&file).unwrap();
            assert_eq!(text, scene.text);
            if let Ok((name, text)) = scene.mesh_file() {
                let written = std::fs::read_to_string(folder.path().join(name)).unwrap();
                assert_eq!(written, text);
            }
        }
    }
}

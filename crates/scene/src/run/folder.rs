//! The folder of a run.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::{Existing, RunOptions};
use crate::InputError;
use crate::atomic_file;

/// What a finished or broken run leaves and a new one replaces.
const OURS: [&str; 2] = ["run.json", "checkpoint.json"];

/// A folder that takes the results of one run.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
}

impl Folder {
    /// Makes the folder, or takes the one that is there as the options say.
    pub(super) fn prepare(options: &RunOptions<'_>) -> anyhow::Result<Self> {
        let path = options.out.clone();
        let holds_run = OURS.iter().any(|name| path.join(name).exists());
        if holds_run && options.existing == Existing::Refuse {
            return Err(
                InputError::new(format!("{} holds a run already", path.display()))
                    .at("--out")
                    .next("give another folder, or --overwrite, or --resume to go on with it")
                    .into(),
            );
        }
        if options.existing == Existing::Overwrite {
            for file in OURS
                .iter()
                .map(|name| path.join(name))
                .filter(|file| file.exists())
            {
                fs::remove_file(&file)
                    .with_context(|| format!("cannot remove {}", file.display()))?;
            }
        }
        fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
        Ok(Self { path })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file whole.
    pub(super) fn write(&self, name: &str, text: &str) -> anyhow::Result<()> {
        atomic_file::save(&self.path.join(name), text)
    }
}

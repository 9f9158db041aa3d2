//! List of the files that a command created in a folder.
//!
//! The format is JSON Lines: a header, followed by the name of each file as a JSON string. A name is appended before
//! the file is created, so that a killed program leaves no unlisted file.

use std::collections::HashSet;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{Error, InputError, atomic_file, inputs};

pub(super) const NAME: &str = "manifest.jsonl";

const SCHEMA: &str = "myovib/manifest/1";

/// Command that created the files, and the input of the command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    schema: String,
    pub(super) command: String,
    /// Version and revision of the program.
    program: String,
    /// Scene, input files and settings of the command. The option `--resume` compares these values with the current
    /// values.
    pub(super) origin: Value,
}

#[derive(Debug, Clone)]
pub(super) struct Manifest {
    pub(super) header: Header,
    /// File names in the order in which they were added.
    pub(super) files: Vec<String>,
    known: HashSet<String>,
    /// Whether the last line on the disk may be incomplete.
    pub(super) is_torn: bool,
}

impl Manifest {
    pub(super) fn new(command: &str, origin: Value, files: &[String]) -> Self {
        Self {
            header: Header {
                schema: SCHEMA.to_owned(),
                command: command.to_owned(),
                program: super::program(),
                origin,
            },
            files: files.to_vec(),
            known: files.iter().cloned().collect(),
            is_torn: false,
        }
    }

    /// Reads the manifest of a folder. Returns `None` if the folder has no manifest.
    ///
    /// # Errors
    /// Fails if the file cannot be read or is not a manifest of this version.
    pub(super) fn read(folder: &Path) -> Result<Option<Self>, InputError> {
        let path = folder.join(NAME);
        let wrong = |found: String| {
            InputError::new("the list of files in the folder cannot be read")
                .at(path.display())
                .found(found)
                .next("choose another folder")
        };
        match fs::symlink_metadata(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => return Ok(None),
            Err(error) => return Err(wrong(error.to_string())),
            Ok(there) if !there.is_file() => return Err(wrong("not a regular file".to_owned())),
            Ok(_) => {}
        }
        let bytes = inputs::content(&path).map_err(|error| wrong(error.to_string()))?;
        let text = String::from_utf8_lossy(&bytes);
        // A last line without a line break is ignored: the program was killed while it wrote this line.
        let mut lines = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
        let header = lines.next().map(serde_json::from_str::<Header>);
        let header = match header {
            Some(Ok(header)) if header.schema == SCHEMA => header,
            Some(Ok(header)) => return Err(wrong(header.schema)),
            Some(Err(error)) => return Err(wrong(error.to_string())),
            None => return Err(wrong(String::new())),
        };
        let names = lines.map(|line| serde_json::from_str::<String>(line).ok());
        let files = names
            .map(|name| name.filter(|name| is_plain_name(name)))
            .collect::<Option<Vec<String>>>()
            .ok_or_else(|| wrong("a line without a file name".to_owned()))?;
        Ok(Some(Self {
            header,
            known: files.iter().cloned().collect(),
            files,
            is_torn: !text.ends_with('\n'),
        }))
    }

    pub(super) fn lists(&self, name: &str) -> bool {
        self.known.contains(name)
    }

    /// Writes the whole manifest.
    pub(super) fn save(&mut self, folder: &Path) -> Result<(), Error> {
        let mut text = serde_json::to_string(&self.header)? + "\n";
        for name in &self.files {
            text += &line(name)?;
        }
        atomic_file::save(&folder.join(NAME), text)?;
        self.is_torn = false;
        Ok(())
    }

    /// Appends a name to the manifest on the disk.
    pub(super) fn add(&mut self, folder: &Path, name: &str) -> Result<(), Error> {
        let path = folder.join(NAME);
        let line = line(name)?;
        if self.is_torn {
            self.save(folder)?;
        }
        self.is_torn = true;
        // The line is written in a single call because other processes may append to the manifest of a sweep at the
        // same time.
        atomic_file::append(&path)
            .and_then(|mut file| file.write_all(line.as_bytes()))
            .map_err(Error::file("write", &path))?;
        self.is_torn = false;
        self.files.push(name.to_owned());
        self.known.insert(name.to_owned());
        Ok(())
    }
}

/// Returns the command that created a file, according to the manifest in the folder of the file. Returns `None` if the
/// manifest is missing or does not list the file.
pub fn command_of(file: &Path) -> Option<String> {
    let (folder, name) = (file.parent()?, file.file_name()?.to_str()?);
    let manifest = Manifest::read(&Path::new(".").join(folder)).ok()??;
    manifest.lists(name).then_some(manifest.header.command)
}

fn line(name: &str) -> Result<String, Error> {
    Ok(serde_json::to_string(name)? + "\n")
}

/// Returns whether a name refers to a file directly in the folder. A damaged manifest must not refer to other files.
fn is_plain_name(name: &str) -> bool {
    let is_special = ["", ".", "..", NAME, super::LOCK].contains(&name);
    !is_special && !name.contains(['/', '\\', '\0'])
}

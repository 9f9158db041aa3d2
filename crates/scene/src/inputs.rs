//! The files that a scene reads, by their content.

use std::cell::RefCell;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A file that a scene reads, as it was.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// The file as the scene names it.
    pub file: PathBuf,
    /// SHA-256 of its content, in hexadecimal.
    pub sha256: String,
}

/// Reads files of a folder and remembers their contents' hashes.
#[derive(Debug)]
pub(crate) struct Inputs<'a> {
    folder: &'a Path,
    read: RefCell<Vec<Input>>,
}

impl<'a> Inputs<'a> {
    /// Files are relative to `folder`.
    pub(crate) fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            read: RefCell::default(),
        }
    }

    /// Where a file lies.
    pub(crate) fn resolve(&self, file: &Path) -> PathBuf {
        self.folder.join(file)
    }

    /// The text of a file, without the mark that some editors put before it. What is no UTF-8 is
    /// left to the reader to stumble over.
    pub(crate) fn read(&self, file: &Path) -> io::Result<String> {
        let bytes = content(&self.resolve(file))?;
        self.read.borrow_mut().push(Input {
            file: file.to_owned(),
            sha256: sha256(&bytes),
        });
        let text = String::from_utf8_lossy(&bytes);
        Ok(text.strip_prefix('\u{feff}').unwrap_or(&text).to_owned())
    }

    /// Where what was read lies.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        let read = self.read.borrow();
        read.iter().map(|input| self.resolve(&input.file)).collect()
    }

    /// What was read.
    pub(crate) fn into_read(self) -> Vec<Input> {
        self.read.into_inner()
    }
}

/// The content of a file that can be looked at again.
///
/// # Errors
/// Those of the file system, and what is no regular file: a pipe waits for ever, a device gives without
/// end.
pub(crate) fn content(path: &Path) -> io::Result<Vec<u8>> {
    match fs::metadata(path)? {
        there if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        there if there.is_file() => fs::read(path),
        _ => Err(io::Error::other("it is not a regular file")),
    }
}

/// SHA-256 in hexadecimal.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

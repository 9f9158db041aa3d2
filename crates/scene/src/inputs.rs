//! Input files of a scene, identified by the hashes of their contents.

use std::cell::RefCell;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Input file of a scene, and its hash at the time of reading.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Path as written in the scene.
    pub file: PathBuf,
    /// SHA-256 hash of the content, in hexadecimal notation.
    pub sha256: String,
}

/// Reader for the files in a folder. It stores the hash of each file that it reads.
#[derive(Debug)]
pub(crate) struct Inputs<'a> {
    folder: &'a Path,
    read: RefCell<Vec<Input>>,
}

impl<'a> Inputs<'a> {
    /// Creates a reader for files whose paths are relative to `folder`.
    pub(crate) fn new(folder: &'a Path) -> Self {
        Self { folder, read: RefCell::default() }
    }

    /// Returns the full path of a file.
    pub(crate) fn resolve(&self, file: &Path) -> PathBuf {
        self.folder.join(file)
    }

    pub(crate) fn read(&self, file: &Path) -> io::Result<Vec<u8>> {
        let bytes = content(&self.resolve(file))?;
        self.read.borrow_mut().push(Input { file: file.to_owned(), sha256: sha256(&bytes) });
        Ok(bytes)
    }

    /// Returns the full paths of all files read so far.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        let read = self.read.borrow();
        read.iter().map(|input| self.resolve(&input.file)).collect()
    }

    pub(crate) fn into_read(self) -> Vec<Input> {
        self.read.into_inner()
    }
}

/// Returns the content of a regular file.
///
/// # Errors
/// Returns the errors of the file system. Also fails for special files, because reading a pipe may block forever and
/// reading a device may never end.
pub(crate) fn content(path: &Path) -> io::Result<Vec<u8>> {
    match fs::metadata(path)? {
        there if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        there if there.is_file() => fs::read(path),
        _ => Err(io::Error::other("it is not a regular file")),
    }
}

/// Returns the text of a regular file.
///
/// # Errors
/// Returns the errors of [`content`]. Also fails if the content is not valid UTF-8.
pub(crate) fn text(path: &Path) -> io::Result<String> {
    String::from_utf8(content(path)?).map_err(io::Error::other)
}

/// Returns the SHA-256 hash in hexadecimal notation.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

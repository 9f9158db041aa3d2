//! Numbered series of files in a folder, and a file that lists them with their times.

use std::io;
use std::path::{Path, PathBuf};

use crate::atomic_file;

/// Fields on the mesh.
pub(super) const FIELDS: &str = "fields";
/// Values at the positions of chains.
pub(super) const PLACES: &str = "places";

/// Complex fields of a response.
pub(super) const AMPLITUDES: &str = "amplitudes";

/// Series of files with one file per time.
#[derive(Debug)]
pub(super) struct Listing {
    folder: PathBuf,
    stem: &'static str,
    /// Times and names of the files written so far.
    entries: Vec<(f64, String)>,
}

impl Listing {
    /// Creates a series in an existing `folder`. `done` contains the times of existing files.
    pub(super) fn new(folder: &Path, stem: &'static str, done: &[f64]) -> Self {
        let entries = done.iter().enumerate();
        Self {
            folder: folder.to_owned(),
            stem,
            entries: entries.map(|(i, &t)| (t, name(stem, i))).collect(),
        }
    }

    /// Returns the times (s) of the files written so far.
    pub(super) fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.entries.iter().map(|(t, _)| *t)
    }

    /// Returns the path of a file that was written earlier but is now missing or empty, if any.
    pub(super) fn missing(&self) -> Option<PathBuf> {
        let files = self.entries.iter().map(|(_, name)| self.folder.join(name));
        let is_there = |file: &PathBuf| file.metadata().is_ok_and(|there| there.len() > 0);
        files.into_iter().find(|file| !is_there(file))
    }

    /// Returns the names of the files that the next call of [`add`](Self::add) writes.
    pub(super) fn next_files(&self) -> Vec<String> {
        vec![name(self.stem, self.entries.len()), self.list()]
    }

    fn list(&self) -> String {
        format!("{}.pvd", self.stem)
    }

    /// Writes the file for time `t`, then the list of all files.
    pub(super) fn add(&mut self, t: f64, text: &str) -> io::Result<()> {
        let name = name(self.stem, self.entries.len());
        atomic_file::write(&self.folder.join(&name), |file| file.write_all(text.as_bytes()))?;
        self.entries.push((t, name));
        let text = pvd(&self.entries);
        let path = self.folder.join(self.list());
        atomic_file::write(&path, |file| file.write_all(text.as_bytes()))
    }
}

fn name(stem: &str, i: usize) -> String {
    format!("{stem}_{i:05}.vtu")
}

fn pvd(entries: &[(f64, String)]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n",
    );
    for (t, name) in entries {
        // Times are rounded because readers find them by value: 0.15 instead of 3 × 0.05 = 0.15000000000000002.
        let t: f64 = format!("{t:.12e}").parse().expect("a number");
        text += &format!("<DataSet timestep=\"{t}\" part=\"0\" file=\"{name}\"/>\n");
    }
    text + "</Collection>\n</VTKFile>\n"
}

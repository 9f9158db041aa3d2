//! Numbered series of files in a folder, and a file that lists them with their times.

use std::path::{Path, PathBuf};

use crate::result_folder::ResultFolder;
use crate::{Error, atomic_file};

/// Numbered series of files with one file per time.
#[derive(Debug)]
pub(crate) struct Listing {
    /// Name of the file that lists all files.
    list: &'static str,
    /// Times and names of the files written so far.
    entries: Vec<(f64, String)>,
}

impl Listing {
    /// Creates a series. `done` contains the times of existing files.
    pub(crate) fn new(list: &'static str, done: &[f64]) -> Self {
        let entries = done.iter().enumerate();
        Self { list, entries: entries.map(|(i, &t)| (t, name(list, i))).collect() }
    }

    /// Returns the times (s) of the files written so far.
    pub(crate) fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.entries.iter().map(|(t, _)| *t)
    }

    /// Returns the path of a file that was written earlier but is now missing or empty, if any.
    pub(crate) fn missing(&self, folder: &Path) -> Option<PathBuf> {
        let files = self.entries.iter().map(|(_, name)| folder.join(name));
        let is_there = |file: &PathBuf| file.metadata().is_ok_and(|there| there.len() > 0);
        files.into_iter().find(|file| !is_there(file))
    }

    /// Writes the file for time `t`, then the list of all files.
    ///
    /// # Errors
    /// Returns the errors of [`ResultFolder::claim`] before anything is written. Also returns the errors of the file
    /// system.
    pub(crate) fn add(&mut self, folder: &ResultFolder, t: f64, text: &str) -> Result<(), Error> {
        let name = name(self.list, self.entries.len());
        let [file, list] = [folder.claim(&name)?, folder.claim(self.list)?];
        atomic_file::save(&file, text)?;
        self.entries.push((t, name));
        atomic_file::save(&list, pvd(&self.entries))
    }
}

fn name(list: &str, i: usize) -> String {
    format!("{}_{i:05}.vtu", list.trim_end_matches(".pvd"))
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

//! Results on disk, one JSON line each, so that a matrix that was interrupted goes on.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use anyhow::Context;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// A line: what was computed, by which version, and the result.
#[derive(Serialize, Deserialize)]
struct Line<T> {
    key: String,
    version: String,
    result: T,
}

/// Results by key, appended to a file as they come.
pub(super) struct Store<T> {
    known: HashMap<String, T>,
    file: Mutex<File>,
}

impl<T: Serialize + DeserializeOwned + Clone> Store<T> {
    /// Reads what this version of the program has left in `path`. A line cut short by an
    /// interruption is computed again.
    pub(super) fn open(path: &Path) -> anyhow::Result<Self> {
        let text = match std::fs::read_to_string(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error).with_context(|| format!("cannot read `{}`", path.display()));
            }
            text => text.unwrap_or_default(),
        };
        let lines = text
            .lines()
            .filter_map(|line| serde_json::from_str::<Line<T>>(line).ok());
        let known = lines
            .filter(|line| line.version == env!("CARGO_PKG_VERSION"))
            .map(|line| (line.key, line.result))
            .collect();
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .with_context(|| format!("cannot write `{}`", path.display()))?;
        if !text.is_empty() && !text.ends_with('\n') {
            writeln!(file)?;
        }
        Ok(Self {
            known,
            file: Mutex::new(file),
        })
    }

    /// The result kept under `key`.
    pub(super) fn get(&self, key: &str) -> Option<&T> {
        self.known.get(key)
    }

    /// Appends a result; a whole line at once.
    pub(super) fn append(&self, key: &str, result: &T) -> anyhow::Result<()> {
        let line = Line {
            key: key.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            result,
        };
        let text = serde_json::to_string(&line)? + "\n";
        let mut file = self.file.lock().expect("no thread panics with the lock");
        file.write_all(text.as_bytes())
            .context("cannot write to the store")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_known_and_a_broken_line_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cells.jsonl");
        let store = Store::<f64>::open(&path).unwrap();
        store.append("a", &1.5).unwrap();
        drop(store);
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        write!(file, "{{\"key\":\"b\",\"vers").unwrap();
        let store = Store::<f64>::open(&path).unwrap();
        store.append("c", &2.5).unwrap();
        let store = Store::<f64>::open(&path).unwrap();
        let found = ["a", "b", "c"].map(|key| store.get(key).copied());
        assert_eq!(found, [Some(1.5), None, Some(2.5)]);
    }
}

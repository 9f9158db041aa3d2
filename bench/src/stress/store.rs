//! Results on disk, one JSON line each, so that a matrix that was interrupted goes on.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use anyhow::Context;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use myovib_scene::versions::Versions;

/// What a result comes from beside its key: results of other origins are not mixed in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Origin {
    version: String,
    /// The source revision; `None` for sources with changes of which it says nothing.
    revision: Option<String>,
    /// CPU seconds allowed.
    cap: f64,
}

impl Origin {
    /// This program, with a cap on CPU seconds.
    pub(super) fn here(cap: f64) -> Self {
        let versions = Versions::found();
        Self {
            version: versions.myovib.to_owned(),
            revision: (!versions.git.ends_with("-modified")).then(|| versions.git.to_owned()),
            cap,
        }
    }

    /// Whether a result of `self` is what `other` would compute.
    fn serves(&self, other: &Self) -> bool {
        self.revision.is_some() && self == other
    }
}

/// A line: what was computed, where it comes from, and the result.
#[derive(Serialize, Deserialize)]
struct Line<T> {
    key: String,
    #[serde(flatten)]
    origin: Origin,
    result: T,
}

/// Results by key, appended to a file as they come.
pub(super) struct Store<T> {
    known: HashMap<String, T>,
    origin: Origin,
    file: Mutex<File>,
}

impl<T: Serialize + DeserializeOwned + Clone> Store<T> {
    /// Reads the results of `origin` in `path`. A line cut short by an interruption is computed
    /// again.
    pub(super) fn open(path: &Path, origin: Origin) -> anyhow::Result<Self> {
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
            .filter(|line| line.origin.serves(&origin))
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
            origin,
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
            origin: self.origin.clone(),
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

    fn origin(revision: &str, cap: f64) -> Origin {
        Origin {
            version: "1.0".to_owned(),
            revision: (revision != "modified").then(|| revision.to_owned()),
            cap,
        }
    }

    #[test]
    fn what_was_kept_is_known_and_a_broken_line_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cells.jsonl");
        let open = || Store::<f64>::open(&path, origin("a1", 20.0)).unwrap();
        open().append("a", &1.5).unwrap();
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        write!(file, "{{\"key\":\"b\",\"vers").unwrap();
        open().append("c", &2.5).unwrap();
        let store = open();
        let found = ["a", "b", "c"].map(|key| store.get(key).copied());
        assert_eq!(found, [Some(1.5), None, Some(2.5)]);
    }

    #[test]
    fn results_of_other_sources_or_caps_are_not_mixed_in() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cells.jsonl");
        let open = |revision, cap| Store::<f64>::open(&path, origin(revision, cap)).unwrap();
        for (revision, value) in [("a1", 1.0), ("b2", 2.0), ("modified", 3.0)] {
            open(revision, 20.0).append("x", &value).unwrap();
        }
        let get = |revision, cap| open(revision, cap).get("x").copied();
        assert_eq!(get("a1", 20.0), Some(1.0));
        assert_eq!(get("b2", 20.0), Some(2.0));
        assert_eq!(get("a1", 10.0), None);
        // What was changed once may have been changed again.
        assert_eq!(get("modified", 20.0), None);
    }
}

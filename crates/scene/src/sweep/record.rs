//! Records of finished cases, which a repeated sweep does not compute again.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::grid::Case;
use super::{Sweep, record_of};
use crate::{Input, inputs};

/// Result and inputs of a case. The result is valid while all inputs are unchanged.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) program: String,
    pub(super) scene: String,
    pub(super) common: Vec<String>,
    pub(super) set: Vec<String>,
    pub(super) inputs: Vec<Input>,
    /// Whether the case ended reproducibly, so that a repeated run would end in the same way.
    pub(super) done: bool,
    /// Names and sizes (in bytes) of the tables in the folder of the case.
    pub(super) tables: BTreeMap<String, u64>,
    pub(super) result: Value,
}

/// Returns the names and sizes (in bytes) of the tables in a folder.
pub(super) fn table_sizes(folder: &Path) -> BTreeMap<String, u64> {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    let sizes = files.filter_map(|file| {
        let name = file.file_name().into_string().ok().filter(|name| name.ends_with(".csv"))?;
        Some((name, file.metadata().ok()?.len()))
    });
    sizes.collect()
}

impl Sweep<'_> {
    /// Returns whether the result of a case is recorded and its tables are unchanged.
    pub(super) fn is_done(&self, case: &Case) -> bool {
        let record = self.record(case).filter(|record| record.done);
        record.is_some_and(|record| record.tables == table_sizes(&self.folder(case)))
    }

    /// Returns the record of a case if the scene, the overrides, the input files and the program are unchanged.
    pub(super) fn record(&self, case: &Case) -> Option<Record> {
        let text = inputs::content(&self.options.out.join(record_of(case))).ok()?;
        let record: Record = serde_json::from_slice(&text).ok()?;
        let same = record.program == self.program
            && record.scene == self.scene
            && record.common == self.options.set
            && record.set == case.set
            && record.inputs.iter().all(|input| self.is_unchanged(input));
        same.then_some(record)
    }

    fn is_unchanged(&self, input: &Input) -> bool {
        let folder = self.options.scene.parent().unwrap_or(Path::new(""));
        let path = folder.join(&input.file);
        let mut hashes = self.hashes.lock().expect("no thread panics while holding the lock");
        let hash = hashes
            .entry(path)
            .or_insert_with_key(|path| Some(inputs::sha256(&inputs::content(path).ok()?)));
        hash.as_ref() == Some(&input.sha256)
    }
}

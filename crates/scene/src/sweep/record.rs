//! Records of finished cases, which a repeated sweep does not compute again.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::grid::Case;
use super::{Sweep, record_of};
use crate::{Input, inputs};

/// Result of a case with its inputs. It is valid while all inputs are unchanged.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) program: String,
    pub(super) scene: String,
    pub(super) common: Vec<String>,
    pub(super) set: Vec<String>,
    pub(super) inputs: Vec<Input>,
    /// Whether the case ended reproducibly: a repeated run would end in the same way.
    pub(super) done: bool,
    pub(super) result: Value,
}

impl Sweep<'_> {
    /// Returns whether a case has its result and its tables.
    pub(super) fn is_done(&self, case: &Case) -> bool {
        let folder = self.folder(case);
        let record = self.record(case).filter(|record| record.done);
        record.is_some_and(|record| {
            let result = &record.result;
            let probes = result["scene"]["probe"].as_array().into_iter().flatten();
            let names = probes.filter_map(|probe| probe["name"].as_str());
            result["analysis"] == "modes"
                || names.map(|name| folder.join(format!("{name}.csv"))).all(|table| table.is_file())
        })
    }

    /// Returns the record of a case if its scene, overrides, files and program are the same.
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
        let mut hashes = self.hashes.lock().expect("no thread panics with the lock");
        let hash = hashes
            .entry(path)
            .or_insert_with_key(|path| Some(inputs::sha256(&inputs::content(path).ok()?)));
        hash.as_ref() == Some(&input.sha256)
    }
}

//! Stores the model evaluations of a fit in a file. A resumed fit repeats the earlier iterations with these evaluations
//! instead of new runs, so its results equal the results of an uninterrupted fit.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Write};
use std::mem;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::model::Effort;
use crate::atomic_file::{self, Growing};
use crate::inputs::{self, sha256};
use crate::result_folder::{FolderRequest, ResultFolder};
use crate::{Error, InputError};

/// Name of the file. It contains one line with a checksum and JSON for each evaluation.
pub(super) const EVALUATIONS: &str = "evaluations.txt";

/// Residuals and their derivatives. The derivatives are stored column by column and may be empty.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Numbers {
    pub(super) residuals: Vec<f64>,
    pub(super) jacobian: Vec<f64>,
}

/// Result of a successful evaluation and the number of its runs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Evaluation {
    pub(super) runs: u64,
    pub(super) numbers: Numbers,
}

/// Successful evaluations, keyed by the parameters, the effort, and whether derivatives were computed.
#[derive(Default)]
pub(super) struct Evaluations {
    known: HashMap<String, Evaluation>,
    /// Intact lines in the file of an earlier fit, and the size of that file in bytes.
    earlier: (String, usize),
    output: RefCell<Output>,
}

#[derive(Default)]
struct Output {
    /// Lines to be written when the file is opened.
    pending: String,
    file: Option<Growing<File>>,
    failed: Option<io::Error>,
}

impl Output {
    /// Appends a line to the file on disk, or to the pending lines if the file is not open yet.
    fn append(&mut self, line: &str) {
        match &mut self.file {
            None => self.pending += line,
            Some(_) if self.failed.is_some() => {}
            Some(file) => {
                let written = file.write_all(line.as_bytes());
                self.failed = written.and_then(|()| atomic_file::sync(&file.0)).err();
            }
        }
    }
}

/// Returns an error if the earlier fit has a different origin, for example another scene or other measurements.
fn expect_origin(request: &FolderRequest<'_>) -> Result<(), InputError> {
    let Some(known) = request.earlier_origin()? else {
        return Ok(()); // the request reports that there is no fit
    };
    let parts = request.origin.as_object().into_iter().flatten();
    let other = parts.filter(|(part, value)| known[part.as_str()] != **value);
    let other: Vec<&str> = other.map(|(part, _)| part.as_str()).collect();
    if other.is_empty() {
        return Ok(());
    }
    let error = InputError::new("the folder contains another fit").at(request.path.display());
    Err(error
        .found(format!("other {}", other.join(", ")))
        .next("repeat that fit with the same arguments and program version, or use --overwrite instead of --resume"))
}

impl Evaluations {
    /// Reads the evaluations of an earlier fit up to the first damaged line. A killed process may leave such a line
    /// behind.
    pub(super) fn read(request: &FolderRequest<'_>) -> Result<Self, Error> {
        request.check()?;
        expect_origin(request)?;
        let bytes = inputs::content(&request.path.join(EVALUATIONS)).unwrap_or_default();
        let mut all = Self { earlier: (String::new(), bytes.len()), ..Self::default() };
        for line in String::from_utf8_lossy(&bytes).split_inclusive('\n') {
            let (sum, text) = line.split_once(' ').unwrap_or_default();
            let found = serde_json::from_str(text).ok();
            let Some((key, evaluation)) = found.filter(|_| sum == sha256(text.as_bytes())) else {
                break;
            };
            all.known.insert(key, evaluation);
            all.earlier.0 += line;
        }
        Ok(all)
    }

    pub(super) fn key(p: &[f64], effort: Effort, with_jacobian: bool) -> String {
        format!("{p:?} {effort:?} {with_jacobian}")
    }

    pub(super) fn known(&self, key: &str) -> Option<&Evaluation> {
        self.known.get(key)
    }

    /// Adds an evaluation. Evaluations with non-finite numbers are not stored, because JSON cannot represent such
    /// numbers. A resumed fit computes these evaluations again.
    pub(super) fn add(&self, key: String, evaluation: &Evaluation) {
        let Numbers { residuals, jacobian } = &evaluation.numbers;
        if !residuals.iter().chain(jacobian).all(|number| number.is_finite()) {
            return;
        }
        if let Ok(text) = serde_json::to_string(&(key, evaluation)) {
            let text = text + "\n";
            let line = format!("{} {text}", sha256(text.as_bytes()));
            self.output.borrow_mut().append(&line);
        }
    }

    /// Creates the file in a locked folder and writes the intact lines of the earlier fit. From then on, each new
    /// evaluation is appended immediately.
    ///
    /// # Errors
    /// Returns [`Error::Input`] if another process has continued the earlier fit since it was read.
    pub(super) fn store_in(&self, folder: &ResultFolder) -> Result<(), Error> {
        let path = folder.path().join(EVALUATIONS);
        let (lines, size) = &self.earlier;
        if inputs::content(&path).map_or(0, |bytes| bytes.len()) != *size {
            let error = InputError::new("another process has continued the fit in this folder");
            let error = error.at(folder.path().display());
            return Err(error.next("resume it again to use the new evaluations").into());
        }
        folder.write(EVALUATIONS, lines)?;
        let file = atomic_file::append(&path).map_err(Error::file("write", &path))?;
        let mut output = self.output.borrow_mut();
        output.file = Some(file);
        let pending = mem::take(&mut output.pending);
        output.append(&pending);
        Ok(())
    }

    /// Returns the first write error since the last call.
    pub(super) fn take_error(&self, folder: &Path) -> Option<Error> {
        let failed = self.output.borrow_mut().failed.take();
        failed.map(Error::file("write", &folder.join(EVALUATIONS)))
    }
}

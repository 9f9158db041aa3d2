//! Evaluations of a fit's model in a file. A resumed fit repeats its iterations with them instead of new runs, so it has
//! the same results as an uninterrupted fit.

use std::cell::RefCell;
use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::effort::Effort;
use crate::inputs::{self, sha256};
use crate::result_folder::FolderRequest;
use crate::{Error, InputError};

/// The file: a line with checksum and JSON for each evaluation.
pub(super) const EVALUATIONS: &str = "evaluations.txt";

/// Residuals and their derivatives by columns; derivatives may be empty.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Numbers {
    pub(super) residuals: Vec<f64>,
    pub(super) jacobian: Vec<f64>,
}

/// Result of the model, with the number of runs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Evaluation {
    pub(super) runs: u64,
    pub(super) outcome: Result<Numbers, String>,
}

/// Evaluations by the parameters, the effort, and whether they have derivatives.
#[derive(Default)]
pub(super) struct Evaluations {
    known: HashMap<String, Evaluation>,
    /// Intact lines of the file.
    lines: String,
    /// Lines to be appended to the file.
    new: RefCell<String>,
}

/// Refuses to resume a fit of another scene or to other measurements.
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
        .next("repeat the arguments of that fit, or use --overwrite instead of --resume"))
}

impl Evaluations {
    /// Reads the evaluations of an earlier fit up to the first damaged line, for example of a killed program.
    pub(super) fn read(request: &FolderRequest<'_>) -> Result<Self, Error> {
        request.check()?;
        expect_origin(request)?;
        let bytes = inputs::content(&request.path.join(EVALUATIONS)).unwrap_or_default();
        let mut all = Self::default();
        for line in String::from_utf8_lossy(&bytes).split_inclusive('\n') {
            let (sum, text) = line.split_once(' ').unwrap_or_default();
            let found = serde_json::from_str(text).ok();
            let Some((key, evaluation)) = found.filter(|_| sum == sha256(text.as_bytes())) else {
                break;
            };
            all.known.insert(key, evaluation);
            all.lines += line;
        }
        Ok(all)
    }

    /// Returns the key of an evaluation.
    pub(super) fn key(p: &[f64], effort: Effort, with_jacobian: bool) -> String {
        format!("{p:?} {effort:?} {with_jacobian}")
    }

    pub(super) fn known(&self, key: &str) -> Option<&Evaluation> {
        self.known.get(key)
    }

    /// Adds an evaluation. JSON has no non-finite numbers, so a resumed fit repeats evaluations with such numbers.
    pub(super) fn add(&self, key: String, evaluation: &Evaluation) {
        let numbers = evaluation.outcome.iter();
        let mut numbers = numbers.flat_map(|n| n.residuals.iter().chain(&n.jacobian));
        if !numbers.all(|number| number.is_finite()) {
            return;
        }
        if let Ok(text) = serde_json::to_string(&(key, evaluation)) {
            let text = text + "\n";
            *self.new.borrow_mut() += &format!("{} {text}", sha256(text.as_bytes()));
        }
    }

    /// Returns the intact lines of the file.
    pub(super) fn lines(&self) -> &str {
        &self.lines
    }

    /// Returns the new lines since the last call.
    pub(super) fn take_new(&self) -> String {
        self.new.take()
    }
}

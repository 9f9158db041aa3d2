//! Errors of scenes. Invalid input is reported in one message that contains the problem, its location, the value found,
//! the allowed values, and the next step.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use myovib_model::ModelError;
use myovib_sparse::SparseError;

use crate::text::plain;

/// Reason why a scene was not computed, or was computed only in part.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Invalid input; nothing was written.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A failed file operation.
    #[error("cannot {action} `{}`", path.display())]
    File {
        /// The failed operation.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// Another process has locked the folder.
    #[error(
        "another process is writing to `{}`\n    next: wait for it, or choose another folder",
        plain(&.0.display().to_string())
    )]
    Busy(PathBuf),
    /// An error of the model or the integrator.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A run that did not reach its end.
    #[error("the run stopped: {0}")]
    Stopped(String),
    /// A result that JSON cannot represent.
    #[error("cannot write the results as JSON")]
    Json(#[from] serde_json::Error),
    /// A panic in a case of a sweep, which is a bug.
    #[error("internal error (bug): {0}")]
    Panic(String),
}

impl Error {
    /// Returns a function for `map_err` that reports the failed `action` on `path`.
    pub fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File { action, path, source }
    }

    /// Converts an error into an error about invalid input, given that no output was written before it occurred. Errors
    /// about insufficient memory or disk space, a locked folder, or an unsuccessful search are unchanged.
    pub fn before_any_output(self) -> Self {
        match self {
            Self::Input(_) | Self::Busy(_) => self,
            Self::Model(ref error) if error.is_search_without_result() => self,
            Self::File { ref source, .. } if is_out_of_space(source) => self,
            _ if self.lacks_memory() => self,
            other => {
                let message = other.to_string();
                let cause = std::error::Error::source(&other).map(ToString::to_string);
                let cause = cause.filter(|cause| !message.ends_with(cause));
                let cause = cause.map_or(String::new(), |cause| format!(": {cause}"));
                InputError::new(message + &cause).into()
            }
        }
    }

    /// Returns whether the cause of the error is insufficient memory for the factors of a matrix.
    pub(crate) fn lacks_memory(&self) -> bool {
        let memory = |error: &SparseError| matches!(error, SparseError::Memory { .. });
        let mut causes = std::iter::successors(std::error::Error::source(self), |e| e.source());
        matches!(self, Self::Model(ModelError::Factorization(error)) if memory(error))
            || causes.any(|e| e.downcast_ref::<SparseError>().is_some_and(memory))
    }
}

/// Returns whether the cause of the error is insufficient space on the file system. In this case, the input is valid.
fn is_out_of_space(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    [FileTooLarge, QuotaExceeded, StorageFull].contains(&error.kind())
}

/// An error in the user's input.
///
/// # Examples
/// ```
/// use myovib_scene::InputError;
/// let error = InputError::new("κ must be positive")
///     .at("scene.toml, line 7, key solid.bulk_modulus")
///     .found(-1e5)
///     .allowed("a number above 0 (Pa), or inf for incompressible")
///     .next("write bulk_modulus = inf for an incompressible muscle");
/// assert!(error.to_string().starts_with("κ must be positive\n   where: scene.toml, line 7"));
/// ```
#[derive(Debug, Clone)]
pub struct InputError {
    message: String,
    details: Vec<(&'static str, String)>,
}

impl InputError {
    /// Creates an error with a one-line description.
    pub fn new(message: impl fmt::Display) -> Self {
        Self { message: message.to_string(), details: Vec::new() }
    }

    /// Adds the location: file, line, key or option. The location is printed first, even if it is added last.
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.details.insert(0, ("where", place.to_string()));
        self
    }

    /// Adds the offending value.
    pub fn found(self, value: impl fmt::Display) -> Self {
        self.with("found", value)
    }

    /// Adds the allowed values.
    pub fn allowed(self, what: impl fmt::Display) -> Self {
        self.with("allowed", what)
    }

    /// Adds a suggestion for the user.
    pub fn next(self, step: impl fmt::Display) -> Self {
        self.with("next", step)
    }

    /// Adds the number of the sweep case in which the error occurred.
    pub(crate) fn case(self, which: impl fmt::Display) -> Self {
        self.with("case", which)
    }

    /// Replaces `--set` in the location with `--vary` if the offending value belongs to the varied values `set` of a
    /// sweep case.
    pub(crate) fn of_vary(mut self, set: &[String]) -> Self {
        for (_, place) in self.details.iter_mut().filter(|(label, _)| *label == "where") {
            let given = place.strip_prefix("--set ").map(str::to_owned);
            if let Some(given) = given.filter(|given| set.contains(given)) {
                *place = format!("--vary {given}");
            }
        }
        self
    }

    fn with(mut self, label: &'static str, text: impl fmt::Display) -> Self {
        self.details.push((label, text.to_string()));
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", plain(&self.message))?;
        for (label, text) in &self.details {
            // Continuation lines are aligned with the first line.
            let lines: Vec<String> = text.lines().map(shortened).collect();
            let text = match lines.join("\n          ") {
                text if text.is_empty() => "nothing".to_owned(),
                text => text,
            };
            write!(f, "\n{label:>8}: {text}")?;
        }
        Ok(())
    }
}

/// Maximum number of characters in a line of a detail. Without this limit, a message could contain a value as long as
/// the scene file.
const LONGEST_LINE: usize = 1000;

fn shortened(line: &str) -> String {
    match line.char_indices().nth(LONGEST_LINE) {
        Some((end, _)) => plain(&line[..end]) + "…",
        None => plain(line),
    }
}

impl std::error::Error for InputError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn details_are_aligned_and_continued_lines_indented() {
        let error = InputError::new("unknown group").found("`lod`").allowed("fixed,\nload");
        let expected = "unknown group\n   found: `lod`\n allowed: fixed,\n          load";
        assert_eq!(error.to_string(), expected);
    }

    /// Regression: in a scene without chains, the list of allowed names was empty and the message
    /// ended in a colon.
    #[test]
    fn an_empty_detail_is_called_nothing() {
        let error = InputError::new("unknown chain `x`").allowed("");
        assert_eq!(error.to_string(), "unknown chain `x`\n allowed: nothing");
    }

    /// Regression: a message repeated a value of 40 000 characters.
    #[test]
    fn long_values_are_shortened() {
        let error = InputError::new("not an expression").found("(".repeat(40_000));
        assert!(error.to_string().chars().count() < LONGEST_LINE + 100);
    }

    /// Regression: escape sequences in names of a scene reached the terminal.
    #[test]
    fn control_characters_are_spelled_out() {
        let error = InputError::new("no group `\u{1b}[2J`").found("a\u{7}b\u{9b}c\nd");
        let expected = "no group `\\u{1b}[2J`\n   found: a\\u{7}b\\u{9b}c\n          d";
        assert_eq!(error.to_string(), expected);
    }
}

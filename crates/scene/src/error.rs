//! Bad input as one clear message: what is wrong and where, what was found, what is allowed, what
//! to do next.

use std::error::Error;
use std::fmt;

/// Something in the user's input is wrong.
///
/// # Examples
/// ```
/// use myovib_scene::InputError;
/// let error = InputError::new("κ must be positive")
///     .at("scene.toml, line 7, key material.kappa")
///     .found(-1e5)
///     .allowed("a number above 0 (Pa), or inf for incompressible")
///     .next("write kappa = inf for an incompressible muscle");
/// assert!(error.to_string().starts_with("κ must be positive\n   where: scene.toml, line 7"));
/// ```
#[derive(Debug, Clone)]
pub struct InputError {
    message: String,
    details: Vec<(&'static str, String)>,
}

impl InputError {
    /// What is wrong, in one line.
    pub fn new(message: impl fmt::Display) -> Self {
        Self {
            message: message.to_string(),
            details: Vec::new(),
        }
    }

    /// Where it is: file, line, key or option. Stands first, whenever it is added.
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.details.insert(0, ("where", place.to_string()));
        self
    }

    /// The offending value.
    pub fn found(self, value: impl fmt::Display) -> Self {
        self.with("found", value)
    }

    /// What would have been right.
    pub fn allowed(self, what: impl fmt::Display) -> Self {
        self.with("allowed", what)
    }

    /// What the user can do about it.
    pub fn next(self, step: impl fmt::Display) -> Self {
        self.with("next", step)
    }

    fn with(mut self, label: &'static str, text: impl fmt::Display) -> Self {
        self.details.push((label, text.to_string()));
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        for (label, text) in &self.details {
            // Continued lines stay under the first one.
            write!(f, "\n{label:>8}: {}", text.replace('\n', "\n          "))?;
        }
        Ok(())
    }
}

impl Error for InputError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn details_are_aligned_and_continued_lines_indented() {
        let error = InputError::new("unknown group")
            .found("`lod`")
            .allowed("fixed,\nload");
        let expected = "unknown group\n   found: `lod`\n allowed: fixed,\n          load";
        assert_eq!(error.to_string(), expected);
    }
}

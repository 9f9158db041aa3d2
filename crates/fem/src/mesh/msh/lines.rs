//! Lines and words of a file.

use std::str::{FromStr, SplitWhitespace};

use crate::error::MshProblem;

/// The remaining lines of a file and the number of the current line.
pub(super) struct Lines<'a> {
    pub(super) text: std::str::Lines<'a>,
    pub(super) number: usize,
}

impl<'a> Lines<'a> {
    /// Returns the next nonblank line, or `None` at the end of the text.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        for line in self.text.by_ref() {
            self.number += 1;
            if !line.trim().is_empty() {
                return Some(line.trim());
            }
        }
        None
    }

    pub(super) fn expect(&mut self, what: &'static str) -> Result<&'a str, MshProblem> {
        self.next().ok_or(MshProblem::Truncated(what))
    }

    pub(super) fn words(&mut self, what: &'static str) -> Result<SplitWhitespace<'a>, MshProblem> {
        Ok(self.expect(what)?.split_whitespace())
    }

    pub(super) fn close(&mut self, end: &'static str) -> Result<(), MshProblem> {
        match self.expect(end)? {
            line if line == end => Ok(()),
            line => Err(MshProblem::Expected { expected: end, found: excerpt(line) }),
        }
    }
}

/// Parses the next word as a number. Messages describe the number as `what`.
pub(super) fn number<T: FromStr>(
    words: &mut SplitWhitespace<'_>,
    what: &'static str,
) -> Result<T, MshProblem> {
    let word = words.next().unwrap_or("end of line");
    word.parse().map_err(|_| MshProblem::Expected { expected: what, found: excerpt(word) })
}

pub(super) fn coordinate(words: &mut SplitWhitespace<'_>) -> Result<f64, MshProblem> {
    let x: f64 = number(words, "a coordinate")?;
    if x.is_finite() {
        Ok(x)
    } else {
        Err(MshProblem::Expected { expected: "a finite coordinate", found: x.to_string() })
    }
}

pub(super) fn excerpt(line: &str) -> String {
    line.chars().take(60).collect()
}

//! What of a body its supports leave free.

use std::fmt;

use myovib_structure::MovingBody;

/// Parts of a body that can move without strain.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParts {
    /// The number of independent motions.
    pub count: usize,
    /// The parts.
    pub parts: Vec<FreePart>,
}

/// A part that can move.
#[derive(Debug, Clone, PartialEq)]
pub struct FreePart {
    /// How many elements it has.
    pub elements: usize,
    /// Whether that is the whole mesh.
    pub is_all: bool,
    /// The middle of it, m.
    pub near: Vec<f64>,
    /// How it can move.
    pub motions: MovingBody,
}

impl fmt::Display for FreePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            elements,
            is_all,
            near,
            motions,
        } = self;
        let near: Vec<String> = near.iter().map(|x| format!("{x:.3}")).collect();
        match is_all {
            true => write!(f, "the body {motions}"),
            false => write!(
                f,
                "a part of {elements} elements near ({}) {motions}",
                near.join(", ")
            ),
        }
    }
}

/// The parts named in a message; what is beyond is counted.
const NAMED: usize = 5;

impl fmt::Display for FreeParts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named: Vec<String> = self
            .parts
            .iter()
            .take(NAMED)
            .map(ToString::to_string)
            .collect();
        f.write_str(&named.join("; "))?;
        match self.parts.len().saturating_sub(NAMED) {
            0 => Ok(()),
            more => write!(f, "; and {more} further parts"),
        }
    }
}

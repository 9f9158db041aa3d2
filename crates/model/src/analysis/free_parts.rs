//! Parts of a body not held by its supports.

use std::fmt;

use myovib_structure::MovingBody;

/// Parts of a body that can move without strain.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParts {
    /// Number of independent motions.
    pub count: usize,
    /// The parts.
    pub parts: Vec<FreePart>,
}

/// A part that can move.
#[derive(Debug, Clone, PartialEq)]
pub struct FreePart {
    /// Number of elements.
    pub elements: usize,
    /// Whether the part is the whole mesh.
    pub is_all: bool,
    /// Center of the part, m.
    pub near: Vec<f64>,
    /// Possible rigid motions of the part.
    pub motions: MovingBody,
}

impl fmt::Display for FreePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { elements, is_all, near, motions } = self;
        let near: Vec<String> = near.iter().map(|x| format!("{x:.3}")).collect();
        match is_all {
            true => write!(f, "the body {motions}"),
            false => {
                write!(f, "a part of {elements} elements near ({}) {motions}", near.join(", "))
            }
        }
    }
}

/// Maximum number of parts listed in a message; the others are only counted.
const NAMED: usize = 5;

impl fmt::Display for FreeParts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named: Vec<String> = self.parts.iter().take(NAMED).map(ToString::to_string).collect();
        f.write_str(&named.join("; "))?;
        match self.parts.len().saturating_sub(NAMED) {
            0 => Ok(()),
            more => write!(f, "; and {more} more parts"),
        }
    }
}

//! Test problems from the literature, with initial values and exact solutions.
//!
//! Each is a [`DaeProblem`](crate::DaeProblem) with consistent initial values
//! ([`Start`]), and, where there is one in closed form, the exact solution. Reference values for
//! the others are in `data/references/` of the repository, with their origin.
//!
//! | problem | index | unknowns | source |
//! |---|---|---|---|
//! | [`Robertson`] | 1 | 3 | Robertson 1966; Hairer & Wanner, Solving ODEs II, IV.1 |

mod robertson;

pub use robertson::Robertson;

use nalgebra_sparse::pattern::SparsityPattern;

/// Consistent initial values.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Initial time.
    pub t: f64,
    /// y(t).
    pub y: Vec<f64>,
    /// ẏ(t).
    pub y_dot: Vec<f64>,
}

/// The pattern of a full n × n matrix; entry (i, j) is value `j * n + i`.
fn full_pattern(n: usize) -> SparsityPattern {
    let offsets = (0..=n).map(|j| j * n).collect();
    let indices = (0..n * n).map(|k| k % n).collect();
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, indices)
        .expect("the columns of a full matrix are sorted and complete")
}

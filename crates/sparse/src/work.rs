//! Counters for solutions of linear systems.

use serde::{Deserialize, Serialize};

/// Cost and accuracy of linear solves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LinearWork {
    /// Number of factorizations.
    pub factorizations: u64,
    /// Number of factorizations with pivoting.
    pub pivoted: u64,
    /// Number of factorizations in single precision.
    #[serde(default)]
    pub in_single_precision: u64,
    /// Number of entries of L and U in the last factorization.
    pub factor_entries: u64,
    /// Number of solves.
    pub solves: u64,
    /// Number of refinements.
    pub refinements: u64,
    /// Largest componentwise backward error, max_i |b − A x|_i / (|A||x| + |b|)_i, of the accepted solutions that were
    /// checked. These are the first solution after each factorization and all refined solutions. The value is finite.
    pub largest_backward_error: f64,
}

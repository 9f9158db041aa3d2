//! Counters for the solution of linear systems.

use serde::Serialize;

/// Cost and accuracy of linear solves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct LinearWork {
    /// Number of factorizations.
    pub factorizations: u64,
    /// Number of factorizations with pivoting.
    pub pivoted: u64,
    /// Entries of L and U of the last factorization.
    pub factor_entries: u64,
    /// Number of solves.
    pub solves: u64,
    /// Number of refinements.
    pub refinements: u64,
    /// Largest componentwise backward error, max_i |b − A x|_i / (|A||x| + |b|)_i, of the checked solutions: the first
    /// one after each factorization and all refined ones.
    pub largest_backward_error: f64,
}

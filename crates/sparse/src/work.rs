//! Counts of the work done on linear systems.

use serde::Serialize;

/// What linear systems cost and how well they were solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct LinearWork {
    /// Factorisations.
    pub factorizations: u64,
    /// Of these, with exchange of pivots, by KLU.
    pub pivoted: u64,
    /// Entries of L and U of the last factorisation.
    pub factor_entries: u64,
    /// Solves.
    pub solves: u64,
    /// Refinements of solutions.
    pub refinements: u64,
    /// The largest componentwise backward error, max_i |b - A x|_i / (|A||x| + |b|)_i, of the
    /// solutions checked: the first after each set-up, and all those refined.
    pub largest_backward_error: f64,
}

//! Counters that only this integrator has.

use std::ops::Add;

use serde::{Deserialize, Serialize};

/// The linear algebra of an integration; what IDAS counts too is in
/// [`Stats`](myovib_dae::Stats).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Work {
    /// Real factorisations: one a linear set-up.
    pub real_factorizations: u64,
    /// Complex factorisations: (s − 1)/2 a linear set-up.
    pub complex_factorizations: u64,
    /// Real solves: one a Newton iteration, one or two an error estimate.
    pub real_solves: u64,
    /// Complex solves: (s − 1)/2 a Newton iteration.
    pub complex_solves: u64,
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            real_factorizations: self.real_factorizations + other.real_factorizations,
            complex_factorizations: self.complex_factorizations + other.complex_factorizations,
            real_solves: self.real_solves + other.real_solves,
            complex_solves: self.complex_solves + other.complex_solves,
        }
    }
}

/// All counters, as the parts of the integrator see them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counters {
    pub(crate) stats: myovib_dae::Stats,
    pub(crate) work: Work,
}

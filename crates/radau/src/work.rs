//! All counters.

use myovib_dae::{Statistics, Work};

/// All counters, as the parts of the integrator see them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counters {
    pub(crate) statistics: Statistics,
    pub(crate) work: Work,
}

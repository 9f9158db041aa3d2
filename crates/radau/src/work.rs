//! Work counters.

use myovib_dae::{Statistics, Work};

/// All counters, shared by the modules of the integrator.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counters {
    pub(crate) statistics: Statistics,
    pub(crate) work: Work,
}

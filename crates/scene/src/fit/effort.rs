//! Effort of the phases of a fit.

/// Duration and accuracy of the runs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Lower limit of the relative tolerance.
    pub(super) least_tolerance: f64,
    /// Computed fraction of the measured time span, from its start.
    pub(super) part: f64,
}

impl Effort {
    /// Full runs: the scene's tolerance, up to the last measurement.
    pub(super) const FULL: Self = Self { least_tolerance: 0.0, part: 1.0 };
}

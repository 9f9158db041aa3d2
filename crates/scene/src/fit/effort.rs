//! Effort spent on the runs of a fit.

/// Duration and accuracy of the runs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Lower limit on the relative tolerance of a run.
    pub(super) least_tolerance: f64,
    /// Computed fraction of the time until the last measurement.
    pub(super) part: f64,
}

impl Effort {
    /// Full runs with the scene's tolerance, up to the last measurement.
    pub(super) const FULL: Self = Self { least_tolerance: 0.0, part: 1.0 };
}

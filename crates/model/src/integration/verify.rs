//! How far off a run is, by a second one at looser tolerances.
//!
//! Error tests bound what a single step adds; what has added up by the end depends on the motion. Of
//! two runs the looser errs more: their difference is about its error, and bounds that of the tighter
//! one where errors fall with the tolerance at all.

/// How much looser the second run is.
pub const LOOSER: f64 = 10.0;

/// How far one recorded quantity may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// Largest magnitude over the run.
    pub size: f64,
    /// Largest difference to the run at [`LOOSER`] times the tolerance.
    pub difference: f64,
}

impl ErrorEstimate {
    /// The difference as a fraction of the size; 0 for a quantity that is zero in both.
    pub fn relative(&self) -> f64 {
        match self.difference {
            0.0 => 0.0,
            difference => difference / self.size,
        }
    }

    /// An estimate for each quantity, from what both runs recorded: one row per time, at the same
    /// times, of one value per quantity. A run that ended early is compared as far as it went.
    pub fn between(rows: &[Vec<f64>], looser: &[Vec<f64>]) -> Vec<Self> {
        let n = rows.first().map_or(0, Vec::len);
        let of = |k: usize| {
            let pairs = || rows.iter().zip(looser).map(|(a, b)| (a[k], b[k]));
            Self {
                size: pairs().fold(0.0, |m, (a, _)| m.max(a.abs())),
                difference: pairs().fold(0.0, |m, (a, b)| m.max((a - b).abs())),
            }
        };
        (0..n).map(of).collect()
    }
}

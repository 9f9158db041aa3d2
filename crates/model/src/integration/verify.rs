//! Error of a run, estimated by a second run at looser tolerances.
//!
//! The error test bounds the error of a single step; the accumulated error depends on the motion.
//! The looser run has the larger error: the difference of both is about its error, and bounds the
//! error of the tighter run if errors decrease with the tolerance.

/// Ratio of the tolerances of the second run to the first.
pub const LOOSER: f64 = 10.0;

/// Estimated error of one recorded quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// Largest magnitude over the run.
    pub size: f64,
    /// Largest difference from the run with [`LOOSER`] times the tolerance.
    pub difference: f64,
}

impl ErrorEstimate {
    /// Returns the difference relative to the size; 0 for a quantity that is zero in both runs.
    pub fn relative(&self) -> f64 {
        match self.difference {
            0.0 => 0.0,
            difference => difference / self.size,
        }
    }

    /// Estimates the error of each quantity from the records of both runs: one row per time, at the
    /// same times, with one value per quantity. If a run ended early, the common part is compared.
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

//! Error of a run, estimated by a second run with looser tolerances.
//!
//! The error test bounds the error of a single step, while the accumulated error depends on the motion. The run with
//! looser tolerances has the larger error, so the difference between the two runs is approximately this error. The
//! difference bounds the error of the tighter run if the error of the looser run is at least twice as large.

use crate::integration::settings::IntegratorKind;

/// Largest relative tolerance of a second run.
const LOOSEST: f64 = 0.5;

/// Returns the ratio of the tolerances of the second run to those of the first, whose largest relative tolerance is
/// `rtol`.
///
/// The steps of a high-order method depend only weakly on the tolerance. If both runs take similar steps, their errors
/// are similar, and the difference between the runs is small. `scripts/errors` measures how often the difference
/// bounds the error with these ratios.
pub fn loosening(integrator: IntegratorKind, rtol: f64) -> f64 {
    let ratio = match integrator {
        IntegratorKind::Bdf | IntegratorKind::Radau5 => 30.0,
        IntegratorKind::Radau9 => 100.0,
        IntegratorKind::Radau13 => 300.0,
    };
    f64::min(ratio, LOOSEST / rtol)
}

/// Estimated error of one recorded quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// Largest magnitude over the run; NaN if no values could be compared.
    pub size: f64,
    /// Largest difference from the run with looser tolerances; NaN if no values could be compared.
    pub difference: f64,
}

impl ErrorEstimate {
    /// Returns the difference relative to the size, or 0 if the quantity is equal in both runs.
    pub fn relative(&self) -> f64 {
        match self.difference {
            0.0 => 0.0,
            difference => difference / self.size,
        }
    }

    /// Estimates the error of a quantity from its values in both runs at the same times.
    pub fn between(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        // Undefined values, such as a phase at rest, are NaN in both runs.
        let pairs = pairs.filter(|(a, b)| !(a.is_nan() && b.is_nan()));
        let sizes = pairs.clone().map(|(a, _)| a.abs());
        let differences = pairs.map(|(a, b)| (a - b).abs());
        Self {
            size: sizes.reduce(f64::max).unwrap_or(f64::NAN),
            difference: differences.max_by(f64::total_cmp).unwrap_or(f64::NAN), // NaN is the largest
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the error of a quantity without any defined value was reported as zero.
    #[test]
    fn nothing_compared_has_no_error() {
        for pairs in [vec![], vec![(f64::NAN, f64::NAN)]] {
            let estimate = ErrorEstimate::between(pairs.into_iter());
            assert!(estimate.size.is_nan() && estimate.difference.is_nan(), "{estimate:?}");
            assert!(estimate.relative().is_nan());
        }
        let one_sided = ErrorEstimate::between([(1.0, f64::NAN), (2.0, 2.0)].into_iter());
        assert!(one_sided.difference.is_nan(), "{one_sided:?}");
        let partial = ErrorEstimate::between([(f64::NAN, f64::NAN), (-2.0, 1.0)].into_iter());
        assert_eq!(partial, ErrorEstimate { size: 2.0, difference: 3.0 });
    }
}

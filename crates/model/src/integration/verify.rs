//! How far off a run is, by a second one at ten times its tolerance.
//!
//! Error tests bound what a single step adds; what has added up by the end depends on the motion. Of
//! two runs the looser errs more: their difference is about its error, and bounds that of the tighter
//! one where errors fall with the tolerance at all.

use crate::integration::settings::Settings;

/// How much looser the second run is.
const LOOSER: f64 = 10.0;

/// How far one recorded quantity may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// Largest magnitude over the run.
    pub size: f64,
    /// Largest difference to the run at ten times the tolerance.
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
}

/// Runs at the tolerances of `settings` and at ten times these, and compares what `run` records: one
/// row per time, at the same times, of one value per quantity. Gives the rows of the tighter run, and
/// an estimate for each quantity.
///
/// # Errors
/// Those of `run`.
///
/// # Panics
/// If the runs record different numbers of times or quantities.
pub fn verify<E>(
    settings: &Settings,
    mut run: impl FnMut(&Settings) -> Result<Vec<Vec<f64>>, E>,
) -> Result<(Vec<Vec<f64>>, Vec<ErrorEstimate>), E> {
    let rtol = LOOSER * settings.relative_tolerance;
    let loose = run(&settings.clone().with_relative_tolerance(rtol))?;
    let rows = run(settings)?;
    assert_eq!(rows.len(), loose.len(), "both runs record the same times");
    let n = rows.first().map_or(0, Vec::len);
    let estimates = (0..n).map(|k| {
        let pairs = || rows.iter().zip(&loose).map(|(a, b)| (a[k], b[k]));
        ErrorEstimate {
            size: pairs().fold(0.0, |m, (a, _)| m.max(a.abs())),
            difference: pairs().fold(0.0, |m, (a, b)| m.max((a - b).abs())),
        }
    });
    let estimates = estimates.collect();
    Ok((rows, estimates))
}

//! When oscillators count as locked to a drive.

use super::history::Settling;

/// "Locked": the centroid runs at the drive's frequency, and the oscillators run together.
///
/// Frequency: over the trailing window the centroid's mean frequency differs from the drive's by
/// less than `slip` turns per window. Coherence: |χ| never falls below `coherence` there. Either
/// alone is not enough: a free chain is coherent at a frequency of its own, and just above the
/// onset of entrainment the centroid follows the drive while the oscillators disagree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LockCriterion {
    /// Turns by which the centroid may slip against the drive in the window.
    pub slip: f64,
    /// Least |χ| in the window.
    pub coherence: f64,
}

impl Default for LockCriterion {
    /// A tenth of a turn (0.005 Hz in 20 s), |χ| ≥ 0.9.
    fn default() -> Self {
        Self {
            slip: 0.1,
            coherence: 0.9,
        }
    }
}

/// The two halves of "locked".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Synchrony {
    /// The centroid runs at the drive's frequency.
    pub follows: bool,
    /// The oscillators run together.
    pub coherent: bool,
}

impl Synchrony {
    /// Both.
    pub fn is_locked(self) -> bool {
        self.follows && self.coherent
    }

    /// `locked`, `follows` (the frequency alone), `coherent` (at a frequency of its own) or `none`.
    pub fn name(self) -> &'static str {
        match (self.follows, self.coherent) {
            (true, true) => "locked",
            (true, false) => "follows",
            (false, true) => "coherent",
            (false, false) => "none",
        }
    }
}

impl LockCriterion {
    /// Judges settled oscillators against a drive of frequency `drive` (Hz).
    pub fn judge(&self, settled: &Settling, drive: f64) -> Synchrony {
        let slip = (settled.frequency.mean - drive).abs() * settled.window;
        Synchrony {
            follows: slip < self.slip,
            coherent: settled.phase.min >= self.coherence,
        }
    }
}

//! Criterion for the locking of oscillators to a drive.

use super::history::Settling;

/// Criterion for locking: the centroid rotates at the frequency of the drive, and the oscillators are coherent.
///
/// Frequency: over the trailing window, the mean frequency of the centroid (determined by counting turns) differs from
/// the drive frequency by less than `slip` turns per window. Coherence: |χ| never falls below `coherence` in this
/// window. Both conditions are needed. A free chain is coherent, but at a different frequency. Just above the onset of
/// entrainment, the centroid follows the drive although the oscillators have different phases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LockCriterion {
    /// Maximum slip of the centroid relative to the drive in the window, turns.
    pub slip: f64,
    /// Minimum |χ| in the window.
    pub coherence: f64,
}

impl Default for LockCriterion {
    /// A tenth of a turn (0.005 Hz in 20 s) and |χ| ≥ 0.9.
    fn default() -> Self {
        Self { slip: 0.1, coherence: 0.9 }
    }
}

/// Result of the two criteria.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Synchrony {
    /// Whether the centroid rotates at the frequency of the drive.
    pub follows: bool,
    /// Whether the oscillators are coherent.
    pub coherent: bool,
}

impl Synchrony {
    /// Returns whether both criteria hold.
    pub fn is_locked(self) -> bool {
        self.follows && self.coherent
    }

    /// Returns `locked`, `follows` (frequency only), `coherent` (at a different frequency) or
    /// `none`.
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
    /// Compares settled oscillators with a drive of frequency `drive` (Hz).
    pub fn judge(&self, settled: &Settling, drive: f64) -> Synchrony {
        let slip = (settled.frequency.mean - drive).abs() * settled.window;
        Synchrony { follows: slip < self.slip, coherent: settled.phase.min >= self.coherence }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_complex::Complex64;

    use super::super::CoherenceHistory;
    use super::*;

    /// Returns 20 s of two oscillators: one follows a drive of 8 Hz, the other runs at 7.75 Hz with
    /// `ratio` times its amplitude. They are in antiphase five times, always between samples.
    fn beats(ratio: f64) -> CoherenceHistory {
        let turning = |frequency: f64, t: f64| Complex64::cis(-TAU * frequency * t);
        let mut history = CoherenceHistory::default();
        for k in 0..=2000 {
            let t = 0.01 * f64::from(k);
            let (driven, free) = (turning(8.0, t), ratio * turning(7.75, t + 0.0013));
            let centroid = (driven + free) / 2.0;
            history.t.push(t);
            history.centroid.push(centroid);
            history.phase.push((driven + free / ratio) / 2.0);
            let rate = -TAU * Complex64::I * (8.0 * driven + 7.75 * free) / 2.0;
            let turned = (centroid.conj() * rate).im / centroid.norm_sqr();
            history.frequency.push(-turned / TAU);
        }
        history
    }

    #[test]
    fn a_centroid_that_passes_by_zero_is_judged_by_its_turns() {
        for (ratio, follows) in [(0.999, true), (1.001, false)] {
            let history = beats(ratio);
            let settled = history.settled(20.0).unwrap();
            let synchrony = LockCriterion::default().judge(&settled, 8.0);
            assert_eq!(synchrony.follows, follows, "{settled:?}");
            assert!(!synchrony.coherent);
        }
    }

    #[test]
    fn a_sample_with_the_centroid_in_zero_does_not_hide_the_frequency() {
        let mut history = beats(0.5);
        history.centroid[700] = Complex64::ZERO;
        history.frequency[700] = f64::NAN;
        let settled = history.settled(20.0).unwrap();
        assert!(settled.frequency.std.is_finite(), "{settled:?}");
        assert!(LockCriterion::default().judge(&settled, 8.0).follows);
    }

    #[test]
    fn oscillators_at_rest_follow_nothing() {
        let history = CoherenceHistory {
            t: vec![0.0, 1.0, 2.0],
            centroid: vec![Complex64::ZERO; 3],
            phase: vec![Complex64::ZERO; 3],
            phasors: Vec::new(),
            frequency: vec![f64::NAN; 3],
        };
        let settled = history.settled(2.0).unwrap();
        assert!(settled.frequency.mean.is_nan());
        let synchrony = LockCriterion::default().judge(&settled, 8.0);
        assert!(!synchrony.follows && !synchrony.coherent);
    }
}

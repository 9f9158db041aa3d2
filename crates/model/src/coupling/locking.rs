//! When oscillators count as locked to a drive.

use super::history::Settling;

/// "Locked": the centroid runs at the drive's frequency, and the oscillators run together.
///
/// Frequency: over the trailing window the centroid's mean frequency, by its turns, differs from
/// the drive's by less than `slip` turns per window. Coherence: |χ| never falls below `coherence`
/// there. Either alone is not enough: a free chain is coherent at a frequency of its own, and just
/// above the onset of entrainment the centroid follows the drive while the oscillators disagree.
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

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_complex::Complex64;

    use super::super::CoherenceHistory;
    use super::*;

    /// 20 s of two oscillators, one that follows a drive of 8 Hz and one of 7.75 Hz and `ratio` of
    /// its size: they are opposed five times, always between samples.
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

//! Rank decisions: decisions about which values of a set are zero, and the certainty of these decisions.

use std::fmt;

/// Values above this fraction of the reference are never treated as zero.
///
/// This is about √(machine ε)/10. Larger values are far above the rounding errors of matrices that were assembled
/// in double precision and deflated by orthogonal transformations.
const MAY_BE_ZERO: f64 = 1e-9;
/// Values below this fraction of the reference are always treated as zero.
const MAY_BE_NONZERO: f64 = 1e-12;
/// Minimum width of a decisive gap, in decades.
const DECISIVE_DECADES: f64 = 3.0;

/// Certainty of a rank decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// Exactly one gap of at least three decades separates zeros from non-zeros.
    Decisive,
    /// No gap or more than one gap is wide enough to separate zeros from other values, or a value is not finite.
    Undecided,
}

/// Separation of a set of values into zeros and non-zeros.
///
/// The values are singular values or row norms. They are sorted between the reference (the magnitude of their
/// matrix) and the level of rounding, which is n ε times the reference. The cut must be in a gap that overlaps the
/// window \[1e-12, 1e-9\] × reference. The widest such gap is used. The decision is decisive if this gap spans at
/// least three decades and no other such gap does.
#[derive(Debug, Clone, PartialEq)]
pub struct RankDecision {
    /// Description of the values.
    pub subject: String,
    /// Number of values.
    pub size: usize,
    /// Number of non-zero values.
    pub rank: usize,
    /// Smallest non-zero value relative to the reference, or 1 if all values are zero.
    pub smallest_kept: f64,
    /// Largest value treated as zero, or the level of rounding if it is larger.
    pub largest_dropped: f64,
    /// Certainty of the decision.
    pub verdict: Verdict,
}

impl RankDecision {
    /// Decides which `magnitudes`, in any order, are zero. The threshold is in the widest gap between the magnitudes
    /// relative to `reference`, the magnitude of the matrix.
    pub(crate) fn new(subject: String, magnitudes: &[f64], reference: f64) -> Self {
        let size = magnitudes.len();
        let reference = if reference > 0.0 { reference } else { 1.0 };
        let rounding = size.max(1) as f64 * f64::EPSILON;
        let mut ladder: Vec<f64> =
            magnitudes.iter().map(|m| (m / reference).max(rounding)).collect();
        ladder.sort_by(|left, right| right.total_cmp(left));
        ladder.insert(0, ladder.first().map_or(1.0, |top| top.max(1.0)));
        ladder.push(rounding);

        // Cut r keeps the r largest values: ladder[r] is above the cut, and ladder[r + 1] is below it.
        let decades = |rank: usize| (ladder[rank] / ladder[rank + 1]).log10();
        let cuts = (0..=size)
            .filter(|&r| ladder[r] >= MAY_BE_NONZERO && ladder[r + 1] <= MAY_BE_ZERO)
            .collect::<Vec<_>>();
        let rank = cuts
            .iter()
            .copied()
            .max_by(|&left, &right| decades(left).total_cmp(&decades(right)))
            .expect("the ladder descends from at least 1 to rounding, so it crosses the window");
        let wide = cuts.iter().filter(|&&r| decades(r) >= DECISIVE_DECADES).count();
        // An overflow makes the decision meaningless, and a NaN would count as zero.
        let finite = magnitudes.iter().all(|m| (m / reference).is_finite());
        Self {
            subject,
            size,
            rank,
            smallest_kept: ladder[rank],
            largest_dropped: ladder[rank + 1],
            verdict: if wide == 1 && finite { Verdict::Decisive } else { Verdict::Undecided },
        }
    }

    /// Returns the number of values treated as zero.
    pub fn nullity(&self) -> usize {
        self.size - self.rank
    }

    /// Returns the width of the gap between zeros and non-zeros, in decades.
    pub fn gap(&self) -> f64 {
        (self.smallest_kept / self.largest_dropped).log10()
    }

    /// Returns whether `magnitude` counts as non-zero.
    pub(crate) fn keeps(&self, magnitude: f64, reference: f64) -> bool {
        magnitude / reference >= self.smallest_kept
    }
}

impl fmt::Display for RankDecision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { subject, size, rank, smallest_kept, largest_dropped, verdict } = self;
        let gap = self.gap();
        write!(f, "{subject}: {rank} of {size}, {smallest_kept:.1e} | {largest_dropped:.1e}, ")?;
        match verdict {
            Verdict::Decisive => write!(f, "gap {gap:.1} decades"),
            Verdict::Undecided => write!(f, "gap {gap:.1} decades, undecided"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decide(magnitudes: &[f64]) -> (usize, Verdict) {
        let decision = RankDecision::new("test".into(), magnitudes, 1.0);
        (decision.rank, decision.verdict)
    }

    #[test]
    fn clear_sets_are_decided() {
        assert_eq!(decide(&[1.0, 0.1, 1e-17]), (2, Verdict::Decisive));
        assert_eq!(decide(&[1.0, 0.1, 1e-6]), (3, Verdict::Decisive));
        assert_eq!(decide(&[0.0, 0.0]), (0, Verdict::Decisive));
        assert_eq!(decide(&[]), (0, Verdict::Decisive));
        // Rounding errors, amplified by three orders of magnitude, are below a clear gap of six decades.
        assert_eq!(decide(&[1.0, 1e-5, 1e-11, 1e-13, 1e-15]), (2, Verdict::Decisive));
    }

    #[test]
    fn a_value_within_the_window_is_undecided() {
        // Five decades separate each pair of neighbors, so both cuts are equally plausible.
        assert_eq!(decide(&[1.0, 1e-5, 1e-10]).1, Verdict::Undecided);
        // A staircase with steps of two decades has no gap of three decades.
        let staircase: Vec<f64> = (0..8).map(|i| 100f64.powi(-i)).collect();
        assert_eq!(decide(&staircase).1, Verdict::Undecided);
    }

    #[test]
    fn non_finite_values_are_undecided() {
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(decide(&[1.0, bad]).1, Verdict::Undecided);
        }
    }

    #[test]
    fn the_reference_sets_the_unit() {
        let decision = RankDecision::new("test".into(), &[1e6, 1e-11], 1e6);
        assert_eq!((decision.rank, decision.verdict), (1, Verdict::Decisive));
        assert!((decision.smallest_kept - 1.0).abs() < f64::EPSILON);
    }
}

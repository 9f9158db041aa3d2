//! One rank decision: which of a set of magnitudes are zero, and how sure that is.

use std::fmt;

/// Magnitudes below this fraction of the reference may be called zero, those above never.
///
/// About √(machine ε)/10: what lies above is far outside the rounding of matrices that were
/// assembled in double precision and deflated by orthogonal transformations.
const MAY_BE_ZERO: f64 = 1e-9;
/// Magnitudes above this fraction of the reference may be called non-zero, those below never.
const MAY_BE_NONZERO: f64 = 1e-12;
/// A gap of this many decades is decisive.
const DECISIVE_DECADES: f64 = 3.0;

/// Whether a rank decision is clear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// There is one way to part zeros from non-zeros by a gap of at least three decades.
    Decisive,
    /// There is no such way, or more than one, or a magnitude is no number.
    Undecided,
}

/// How the magnitudes of one set were parted into zero and non-zero.
///
/// The magnitudes (singular values, or norms of rows) are put in order between the reference (the
/// size of the matrix they come from) and the level of rounding, n ε times the reference. A cut
/// may lie in any gap that reaches into the window \[1e-12, 1e-9\] × reference; the widest is taken.
/// It is decisive when it spans at least three decades and no second one does.
#[derive(Debug, Clone, PartialEq)]
pub struct RankDecision {
    /// What was looked at.
    pub subject: String,
    /// How many magnitudes there are.
    pub size: usize,
    /// How many of them are non-zero.
    pub rank: usize,
    /// The smallest magnitude kept, as a fraction of the reference; the reference, 1, if none is.
    pub smallest_kept: f64,
    /// The largest magnitude called zero, or the level of rounding if that is larger.
    pub largest_dropped: f64,
    /// Whether the decision is clear.
    pub verdict: Verdict,
}

impl RankDecision {
    /// Parts `magnitudes`, in any order, of a matrix whose size is `reference`.
    pub(crate) fn new(subject: String, magnitudes: &[f64], reference: f64) -> Self {
        let size = magnitudes.len();
        let reference = if reference > 0.0 { reference } else { 1.0 };
        let rounding = size.max(1) as f64 * f64::EPSILON;
        let mut ladder: Vec<f64> = magnitudes
            .iter()
            .map(|m| (m / reference).max(rounding))
            .collect();
        ladder.sort_by(|left, right| right.total_cmp(left));
        ladder.insert(0, ladder.first().map_or(1.0, |top| top.max(1.0)));
        ladder.push(rounding);

        // Cut number r keeps the r largest magnitudes: above it ladder[r], below it ladder[r + 1].
        let decades = |rank: usize| (ladder[rank] / ladder[rank + 1]).log10();
        let cuts = (0..=size)
            .filter(|&r| ladder[r] >= MAY_BE_NONZERO && ladder[r + 1] <= MAY_BE_ZERO)
            .collect::<Vec<_>>();
        let rank = cuts
            .iter()
            .copied()
            .max_by(|&left, &right| decades(left).total_cmp(&decades(right)))
            .expect("the ladder runs from at least 1 down to rounding, so it crosses the window");
        let wide = cuts
            .iter()
            .filter(|&&r| decades(r) >= DECISIVE_DECADES)
            .count();
        // What has overflowed says nothing, and a NaN would pass for zero.
        let finite = magnitudes.iter().all(|m| (m / reference).is_finite());
        Self {
            subject,
            size,
            rank,
            smallest_kept: ladder[rank],
            largest_dropped: ladder[rank + 1],
            verdict: if wide == 1 && finite {
                Verdict::Decisive
            } else {
                Verdict::Undecided
            },
        }
    }

    /// How many magnitudes were called zero.
    pub fn nullity(&self) -> usize {
        self.size - self.rank
    }

    /// The width of the gap between what was kept and what was dropped, in decades.
    pub fn gap(&self) -> f64 {
        (self.smallest_kept / self.largest_dropped).log10()
    }

    /// Whether one of the magnitudes it was made from was kept.
    pub(crate) fn keeps(&self, magnitude: f64, reference: f64) -> bool {
        magnitude / reference >= self.smallest_kept
    }
}

impl fmt::Display for RankDecision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            subject,
            size,
            rank,
            smallest_kept,
            largest_dropped,
            verdict,
        } = self;
        let gap = self.gap();
        write!(
            f,
            "{subject}: {rank} of {size}, {smallest_kept:.1e} | {largest_dropped:.1e}, "
        )?;
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
        // Rounding that grew by three orders, below a clear gap of six decades.
        assert_eq!(
            decide(&[1.0, 1e-5, 1e-11, 1e-13, 1e-15]),
            (2, Verdict::Decisive)
        );
    }

    #[test]
    fn a_value_amid_the_window_is_undecided() {
        // Five decades to either neighbour: two cuts are as good as each other.
        assert_eq!(decide(&[1.0, 1e-5, 1e-10]).1, Verdict::Undecided);
        // A staircase of two decades a step never has a gap of three.
        let staircase: Vec<f64> = (0..8).map(|i| 100f64.powi(-i)).collect();
        assert_eq!(decide(&staircase).1, Verdict::Undecided);
    }

    #[test]
    fn magnitudes_that_are_no_numbers_decide_nothing() {
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

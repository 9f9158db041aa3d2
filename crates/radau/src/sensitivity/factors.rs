//! How long the factors of one step serve others.

/// The factors of an earlier step on the way back or of the run, and what they were good for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factors {
    /// The size of the step they were made for.
    h: f64,
    /// The directions that this step took; of factors of the run those to be expected, if known.
    fresh: Option<usize>,
    is_stale: bool,
}

/// So many directions more than with fresh factors are dearer than these, which serve several steps: a set-up
/// costs as much as five directions (ten solves; a direction is a solve and a product with the tangents at all
/// stages, which costs about the same). One direction more or less is chance.
const STALE: usize = 3;

/// Steps longer or shorter by a larger factor r get factors of their own. Where inertia counts those at hand
/// are wrong by r², which leaves about (r − 1)/(r + 1) of the residual a direction. On row 4 of Table 2 to
/// t = 2 set-ups and directions together cost least between 1.05 and 1.1, and more at 1.25.
const WINDOW: f64 = 1.1;

impl Factors {
    /// Those for steps of size `h`.
    pub(super) fn new(h: f64, fresh: Option<usize>) -> Self {
        Self {
            h,
            fresh,
            is_stale: false,
        }
    }

    /// The directions that fresh factors took.
    pub(super) fn fresh(&self) -> Option<usize> {
        self.fresh
    }

    /// Whether they are to be used for a step of size `h`.
    pub(super) fn serve(&self, h: f64) -> bool {
        !self.is_stale && (h / self.h).max(self.h / h) <= WINDOW
    }

    /// Takes note of the `directions` that a step took.
    pub(super) fn note(&mut self, directions: usize) {
        let fresh = *self.fresh.get_or_insert(directions);
        self.is_stale = directions > fresh + STALE;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_serve_until_a_step_takes_many_more_directions() {
        let mut factors = Factors::new(0.1, None);
        for (directions, serves) in [(4, true), (5, true), (7, true), (5, true), (8, false)] {
            factors.note(directions);
            assert_eq!(factors.serve(0.1), serves, "{factors:?}");
        }
    }

    #[test]
    fn factors_of_the_run_are_held_to_what_fresh_ones_took() {
        let mut factors = Factors::new(0.1, Some(4));
        factors.note(8);
        assert!(!factors.serve(0.1), "{factors:?}");
        assert_eq!(factors.fresh(), Some(4));
    }

    #[test]
    fn a_step_of_another_size_gets_its_own() {
        let factors = Factors::new(0.1, None);
        assert!(factors.serve(0.105) && factors.serve(0.095));
        assert!(!factors.serve(0.2) && !factors.serve(0.05));
    }
}

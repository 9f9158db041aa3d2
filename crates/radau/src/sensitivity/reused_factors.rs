//! Reuse of the factors of one step in other steps.

/// Factors from the run or from an earlier step of the backward pass, and their quality as a preconditioner.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReusedFactors {
    /// Step size for which the factors were computed.
    h: f64,
    /// Number of search directions in the step for which the matrix was factorized. For factors from the run, it is the
    /// expected number, if known.
    fresh: Option<usize>,
    is_stale: bool,
}

/// Largest number of additional directions, compared with fresh factors, that GCR may need before the matrix is
/// factorized again. A matrix setup costs about as much as five directions or ten solves. (A direction consists of a
/// solve and a product with the tangents at all stages, which have about the same cost.) A difference of one direction
/// may be random.
const STALE: usize = 3;

/// Largest ratio r of two step sizes for which factors are reused. If inertia dominates, the matrices differ by the
/// factor r², and each direction reduces the residual by a factor of about (r − 1)/(r + 1). For row 4 of Table 2 up to
/// t = 2, the total cost of setups and directions is lowest for limits between 1.05 and 1.1, and higher for 1.25.
const WINDOW: f64 = 1.1;

impl ReusedFactors {
    /// Creates the record for factors computed for step size `h`.
    pub(super) fn new(h: f64, fresh: Option<usize>) -> Self {
        Self { h, fresh, is_stale: false }
    }

    /// Returns the number of directions with fresh factors, if known.
    pub(super) fn fresh(&self) -> Option<usize> {
        self.fresh
    }

    /// Returns whether the factors may be used for a step of size `h`.
    pub(super) fn serve(&self, h: f64) -> bool {
        !self.is_stale && (h / self.h).max(self.h / h) <= WINDOW
    }

    /// Records the number of `directions` that a step needed.
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
        let mut factors = ReusedFactors::new(0.1, None);
        for (directions, serves) in [(4, true), (5, true), (7, true), (5, true), (8, false)] {
            factors.note(directions);
            assert_eq!(factors.serve(0.1), serves, "{factors:?}");
        }
    }

    #[test]
    fn factors_of_the_run_are_held_to_what_fresh_ones_took() {
        let mut factors = ReusedFactors::new(0.1, Some(4));
        factors.note(8);
        assert!(!factors.serve(0.1), "{factors:?}");
        assert_eq!(factors.fresh(), Some(4));
    }

    #[test]
    fn a_step_of_another_size_gets_its_own() {
        let factors = ReusedFactors::new(0.1, None);
        assert!(factors.serve(0.105) && factors.serve(0.095));
        assert!(!factors.serve(0.2) && !factors.serve(0.05));
    }
}

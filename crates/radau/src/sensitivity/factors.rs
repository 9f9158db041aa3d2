//! How long the factors of one step serve others.

/// The factors of an earlier step on the way back, and what they were good for.
///
/// A set-up is paid for once, and the steps after it need the more directions the older it is. The mean
/// cost of a step, with its share of the set-up, falls at first; it is least where the next step would be
/// dearer than it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factors {
    /// The size of the step they were made for.
    h: f64,
    steps: usize,
    /// The directions that these took, and those that cost as much as the set-up.
    spent: usize,
    /// Whether the last step was dearer than the mean of all.
    is_dear: bool,
}

/// So many directions cost as much as a set-up: ten solves. A direction is a solve, a product with the
/// tangents at all stages, which costs about the same, and some products of vectors.
const SET_UP: usize = 5;

/// Steps longer or shorter by a larger factor r get factors of their own. Where inertia counts those at hand
/// are wrong by r², which leaves about (r − 1)/(r + 1) of the residual a direction. On row 4 of Table 2 to
/// t = 2 set-ups and directions together cost least between 1.05 and 1.1, and more at 1.25.
const WINDOW: f64 = 1.1;

impl Factors {
    /// Fresh ones for steps of size `h`.
    pub(super) fn new(h: f64) -> Self {
        Self {
            h,
            steps: 0,
            spent: SET_UP,
            is_dear: false,
        }
    }

    /// Whether they are to be used for a step of size `h`.
    pub(super) fn serve(&self, h: f64) -> bool {
        !self.is_dear && (h / self.h).max(self.h / h) <= WINDOW
    }

    /// Takes note of the `directions` that a step took.
    pub(super) fn note(&mut self, directions: usize) {
        self.steps += 1;
        self.spent += directions;
        self.is_dear = directions * self.steps > self.spent;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_serve_until_a_step_is_dearer_than_the_mean() {
        let mut factors = Factors::new(0.1);
        // 5 for the set-up: means of 9, 7, 6 ⅓ and 6; a step of 6 is not dearer, one of 8 is.
        for (directions, serves) in [
            (4, true),
            (5, true),
            (5, true),
            (5, true),
            (6, true),
            (8, false),
        ] {
            factors.note(directions);
            assert_eq!(factors.serve(0.1), serves, "{factors:?}");
        }
    }

    #[test]
    fn factors_serve_for_ever_where_steps_do_not_become_dearer() {
        let mut factors = Factors::new(0.1);
        (0..1000).for_each(|_| factors.note(7));
        assert!(factors.serve(0.1));
    }

    #[test]
    fn a_step_of_another_size_gets_its_own() {
        let factors = Factors::new(0.1);
        assert!(factors.serve(0.105) && factors.serve(0.095));
        assert!(!factors.serve(0.2) && !factors.serve(0.05));
    }
}

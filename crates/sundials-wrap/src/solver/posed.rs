//! Data of backward problems for the functions that IDAS calls.

use super::linear::WholeLu;
use crate::adjoint::{BackwardProblem, ForwardState};
use myovib_dae::Tolerances;

/// A backward problem with the data for its evaluation.
pub(super) struct RegisteredProblem<P> {
    pub(super) problem: Box<dyn BackwardProblem<P> + Send>,
    pub(super) lu: WholeLu,
    pub(super) tolerances: Tolerances,
    pub(super) weights: Vec<f64>,
    pub(super) state: ForwardState,
}

/// How many steps may be repeated from a checkpoint: C has room for no more, and does not look. Each step
/// begins with the error weights of y and of the sensitivities, one after the other.
#[derive(Default)]
pub(super) struct Repeating {
    /// Maximum number of error weights: the number of steps between two checkpoints; `None` during
    /// the forward run.
    pub(super) most: Option<usize>,
    /// Error weights since a backward problem was evaluated.
    pub(super) weights: usize,
}

impl Repeating {
    /// Counts the error weights that IDAS requests; returns `false` if they belong to a step beyond
    /// the buffer.
    pub(super) fn has_room(&mut self) -> bool {
        self.weights += 1;
        self.most.is_none_or(|most| self.weights <= most)
    }
}

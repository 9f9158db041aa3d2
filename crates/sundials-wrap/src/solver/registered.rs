//! Backward problems, with the data for the functions called by IDAS.

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

/// Counts the steps that IDAS repeats from a checkpoint. The C buffer has a fixed number of entries, and IDAS does not
/// check for overflow. Each step begins with the error weights of y, followed by the error weights of the
/// sensitivities.
#[derive(Default)]
pub(super) struct Repeating {
    /// Maximum number of error weights, which equals the number of steps between two checkpoints. `None` during the
    /// forward run.
    pub(super) most: Option<usize>,
    /// Number of requests for error weights since the last evaluation of a backward problem.
    pub(super) weights: usize,
}

impl Repeating {
    /// Counts a request of IDAS for error weights. Returns `false` if the request belongs to a step beyond the buffer.
    pub(super) fn has_room(&mut self) -> bool {
        self.weights += 1;
        self.most.is_none_or(|most| self.weights <= most)
    }
}

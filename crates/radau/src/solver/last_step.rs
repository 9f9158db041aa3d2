//! What an accepted step leaves to those who linearise at its stages.

use myovib_dae::{LinearSolver, Problem};

use super::state::RadauSolver;
use crate::dense::Collocation;
use crate::method::Method;
use crate::options::{RadauOptions, StepSize};
use crate::weights::Weights;

/// Steps chosen for an error that cannot have them repeated grow by this factor at most.
const GROWTH: f64 = 2.0;

/// The last accepted step, with the matrices that it was solved with.
pub(crate) struct AcceptedStep<'a, P, M> {
    pub(crate) problem: &'a mut P,
    pub(crate) matrices: &'a mut M,
    pub(crate) method: &'a Method,
    pub(crate) options: &'a RadauOptions,
    pub(crate) weights: &'a mut Weights<P>,
    /// 1 for components in the error test, 0 for others.
    pub(crate) mask: &'a [f64],
    /// The stages, as the step's equations were solved for them.
    pub(crate) collocation: Collocation,
    /// How many steps there were since the start.
    pub(crate) number: u64,
}

impl<P, M> RadauSolver<P, M> {
    /// The last accepted step. Its matrices are those it was solved with: they are renewed when the
    /// next step is tried.
    pub(crate) fn accepted(&mut self) -> AcceptedStep<'_, P, M> {
        let mut collocation = self.collocation.clone();
        self.multipliers
            .put_back(self.y.len(), &mut collocation.increments);
        AcceptedStep {
            problem: &mut self.problem,
            matrices: &mut self.matrices,
            method: &self.method,
            options: &self.options,
            weights: &mut self.weights,
            mask: self.error_test.mask(),
            collocation,
            number: self.counters.statistics.steps,
        }
    }
}

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Chooses the next step for this estimated error of the last one too, in units of tolerances.
    pub(crate) fn heed(&mut self, error: f64) {
        if let StepSize::Adaptive = self.options.step_size {
            let h = self.collocation.h;
            let proposal = self.control.propose(h, error, 1).min(GROWTH * h);
            let proposal = self.kept(h, proposal);
            self.h = self.h.map(|next| next.min(proposal));
        }
    }
}

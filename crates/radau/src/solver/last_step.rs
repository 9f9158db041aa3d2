//! What an accepted step leaves to those who linearise at its stages.

use super::state::RadauSolver;
use crate::dense::Collocation;
use crate::method::Method;
use crate::options::RadauOptions;
use crate::weights::Weights;

/// The last accepted step, with the matrices that it was solved with.
pub(crate) struct AcceptedStep<'a, P, M> {
    pub(crate) problem: &'a mut P,
    pub(crate) matrices: &'a mut M,
    pub(crate) method: &'a Method,
    pub(crate) options: &'a RadauOptions,
    pub(crate) weights: &'a mut Weights<P>,
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
            collocation,
            number: self.counters.statistics.steps,
        }
    }
}

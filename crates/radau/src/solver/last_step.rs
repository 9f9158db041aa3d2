//! What an accepted step leaves to those who linearise at its stages.

use myovib_dae::{LinearSolver, Outcome, Problem};

use super::state::RadauSolver;
use crate::dense::Collocation;
use crate::error::RadauError;
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
    /// The algebraic variables.
    pub(crate) algebraic: &'a [usize],
    /// The stages, as the step's equations were solved for them.
    pub(crate) collocation: Collocation,
    /// Its number, from 1.
    pub(crate) number: u64,
}

impl<P, M> RadauSolver<P, M> {
    /// The last accepted step. Its matrices are those it was solved with: they are renewed when the
    /// next step is tried.
    pub(crate) fn accepted(&mut self) -> AcceptedStep<'_, P, M> {
        let mut collocation = self.collocation.clone();
        self.multipliers
            .put_back(self.y.len(), &mut collocation.increments);
        let number = self.counters.statistics.steps;
        self.at_step(collocation, number)
    }

    /// The step with these stages and this number, and the matrices as they are.
    pub(crate) fn at_step(
        &mut self,
        collocation: Collocation,
        number: u64,
    ) -> AcceptedStep<'_, P, M> {
        AcceptedStep {
            problem: &mut self.problem,
            matrices: &mut self.matrices,
            method: &self.method,
            options: &self.options,
            weights: &mut self.weights,
            mask: self.error_test.mask(),
            algebraic: &self.algebraic,
            collocation,
            number,
        }
    }
}

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Chooses the next step for this estimated error of the last one too, in units of tolerances.
    pub(crate) fn heed(&mut self, error: f64) {
        if let StepSize::Adaptive = self.options.step_size {
            let h = self.collocation.h;
            let proposal = self.control.propose(h, error, 1);
            // The limit last: within the window it would keep h for ever.
            let proposal = self.kept(h, proposal).min(GROWTH * h);
            self.h = self.h.map(|next| next.min(proposal));
        }
    }

    /// Whether the last accepted step was taken as if it were the first.
    pub(crate) fn began_afresh(&self) -> bool {
        self.began_afresh
    }

    /// Number of starts after the first: each `reinit` and each `restore`.
    pub(crate) fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Whether a hidden constraint magnifies what is left of errors.
    pub(crate) fn is_constrained(&self) -> bool {
        self.multipliers.any()
    }

    /// How much Newton's corrections contracted in the last accepted step; 0 where one was enough.
    pub(crate) fn contraction(&self) -> f64 {
        self.newton.contraction
    }

    /// The size of step for which the matrices are set up, if they are.
    pub(crate) fn set_up_for(&self) -> Option<f64> {
        self.set_up_for
    }

    /// The end of the last accepted step, whether or not there is a pause in it.
    pub(crate) fn step_end(&self) -> f64 {
        self.t
    }

    /// Its size.
    pub(crate) fn last_step_size(&self) -> f64 {
        self.collocation.h
    }

    /// y at its end.
    pub(crate) fn y_unpaused(&self) -> &[f64] {
        &self.y
    }

    /// The bounds of the last accepted step and whether dense output limits its size, with which it can be [repeated](Self::repeat).
    pub(crate) fn bounds(&self) -> ([f64; 2], bool) {
        (self.bounds, self.interpolation.active)
    }

    /// Takes a step once more, within the bounds it had, in the state the solver was in: bit by bit the same.
    /// Roots are not looked for, which changes no step.
    pub(crate) fn repeat(
        &mut self,
        ([t_out, limit], dense_output): ([f64; 2], bool),
    ) -> Result<Outcome, RadauError> {
        self.interpolation.active = dense_output;
        self.pause = None;
        self.accepted_step(t_out, limit)
    }
}

//! Access to the last accepted step, for linearizations at its stages.

use myovib_dae::{LinearSolver, Outcome, Problem};

use super::state::RadauSolver;
use crate::dense::Collocation;
use crate::error::RadauError;
use crate::method::Method;
use crate::options::{RadauOptions, StepSize};
use crate::weights::Weights;

/// Maximum step growth if the controlling error is known only after the step is accepted.
const GROWTH: f64 = 2.0;

/// Last accepted step, with the matrices of its Newton iterations.
pub(crate) struct AcceptedStep<'a, P, M> {
    pub(crate) problem: &'a mut P,
    pub(crate) matrices: &'a mut M,
    pub(crate) method: &'a Method,
    pub(crate) options: &'a RadauOptions,
    pub(crate) weights: &'a mut Weights<P>,
    /// 1 for components included in the error test, 0 for excluded components.
    pub(crate) mask: &'a [f64],
    pub(crate) algebraic: &'a [usize],
    /// Increments of the stages that solve the equations of the step.
    pub(crate) collocation: Collocation,
    /// One-based number of the step.
    pub(crate) number: u64,
}

impl<P, M> RadauSolver<P, M> {
    /// Returns the last accepted step. Its matrices remain valid until the next attempt at a step.
    pub(crate) fn accepted(&mut self) -> AcceptedStep<'_, P, M> {
        let mut collocation = self.collocation.clone();
        self.multipliers.undo_removal(self.y.len(), &mut collocation.increments);
        let number = self.counters.statistics.steps;
        self.at_step(collocation, number)
    }

    /// Returns a step with the given stages and number, and with the current matrices.
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
    /// Limits the size of the next step by the given estimated error of the last step, in units of the tolerances.
    pub(crate) fn limit_next_step_by_error(&mut self, error: f64) {
        if let StepSize::Adaptive = self.options.step_size {
            let h = self.collocation.h;
            let proposal = self.control.propose(h, error, 1);
            // This limit is applied after the step window. In the opposite order, h would never change.
            let proposal = self.step_size_after(h, proposal).min(GROWTH * h);
            self.h = self.h.map(|next| next.min(proposal));
        }
    }

    /// Returns whether the last accepted step was treated as a first step.
    pub(crate) fn began_afresh(&self) -> bool {
        self.began_afresh
    }

    /// Returns the number of starts after the first one. Each `reinit` and each `restore` is a start.
    pub(crate) fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Returns whether a step was taken after the first `followed` steps.
    ///
    /// # Errors
    /// Fails if several steps were taken, or if the number of restarts differs.
    pub(crate) fn has_new_step(&self, restarts: u64, followed: u64) -> Result<bool, RadauError> {
        if self.restarts != restarts {
            return Err(RadauError::StartedAgain { t: self.t() });
        }
        let steps = self.counters.statistics.steps;
        match steps.abs_diff(followed) {
            0 => Ok(false),
            1 if steps > followed => Ok(true),
            missed => Err(RadauError::Missed { steps: missed }),
        }
    }

    /// Returns whether a hidden constraint amplifies remaining errors.
    pub(crate) fn is_constrained(&self) -> bool {
        self.multipliers.any()
    }

    /// Returns the contraction of Newton's corrections in the last accepted step, or 0 if one correction was
    /// sufficient.
    pub(crate) fn contraction(&self) -> f64 {
        self.newton.contraction
    }

    /// Returns the step size for which the matrices are set up, if any.
    pub(crate) fn set_up_for(&self) -> Option<f64> {
        self.set_up_for
    }

    /// Returns the end of the last accepted step, even if the integration pauses within it.
    pub(crate) fn step_end(&self) -> f64 {
        self.t
    }

    pub(crate) fn last_step_size(&self) -> f64 {
        self.collocation.h
    }

    /// Returns y at the end of the last accepted step, even if the integration pauses within it.
    pub(crate) fn y_unpaused(&self) -> &[f64] {
        &self.y
    }

    /// Returns the time limits of the last accepted step, and whether dense output is used. Both are needed to
    /// [repeat](Self::repeat) the step.
    pub(crate) fn time_limits(&self) -> ([f64; 2], bool) {
        (self.time_limits, self.interpolation.active)
    }

    /// Repeats a step with the same time limits and from the same state of the solver, with bitwise identical results.
    /// Root functions are not evaluated, because they do not affect the step.
    pub(crate) fn repeat(
        &mut self,
        ([t_out, limit], dense_output): ([f64; 2], bool),
    ) -> Result<Outcome, RadauError> {
        self.interpolation.active = dense_output;
        self.pause = None;
        self.accepted_step(t_out, limit)
    }
}
